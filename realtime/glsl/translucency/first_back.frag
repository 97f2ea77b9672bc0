#version 430
// How far the nearest back face is.
#include "lib/centred_distance.glsl"
uniform vec3 offset;
in vec3 from_centre;
layout(location = 0) out vec2 found;
void main() {
    found = vec2(centred_distance(from_centre, offset), 1.0);
}
