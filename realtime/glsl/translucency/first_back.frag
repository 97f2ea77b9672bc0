#version 430
// How far the nearest back face is.
#include "lib/centred_distance.glsl"
#include "translucency/face.glsl"
uniform vec3 offset;
layout(location = 0) out vec2 found;
void main() {
    found = vec2(centred_distance(place_on_face(), offset), 1.0);
}
