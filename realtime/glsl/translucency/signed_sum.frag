#version 430
// Blended additively, without culling or a depth test: back faces count up, front faces down, in any order.
#include "lib/centred_distance.glsl"
#include "translucency/face.glsl"
uniform vec3 offset;
layout(location = 0) out vec2 sum_count;
void main() {
    sum_count = (gl_FrontFacing ? -1.0 : 1.0) * vec2(centred_distance(place_on_face(), offset), 1.0);
}
