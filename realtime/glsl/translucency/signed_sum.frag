#version 430
// Blended additively, without culling or a depth test: back faces count up, front faces down, in any order.
#include "lib/centred_distance.glsl"
uniform vec3 offset;
in vec3 from_centre;
layout(location = 0) out vec2 sum_count;
void main() {
    sum_count = (gl_FrontFacing ? -1.0 : 1.0) * vec2(centred_distance(from_centre, offset), 1.0);
}
