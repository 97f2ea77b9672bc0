#version 430
// What each place sees along its directions, as dense as the cosine: the nearest triangle; -1: none, -2: the back of one.
// Neighbouring invocations are neighbouring places, whose rays take nearly the same way.
#include "character/places.glsl"
#include "indirect_grid/first_hit.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 3) writeonly buffer Hits { int hits[]; };
uniform float offset;

void main() {
    int place = int(gl_GlobalInvocationID.x), ray = int(gl_GlobalInvocationID.y);
    if (place >= place_count) return;
    vec3 direction = ray_direction(place, ray);
    int met = first_hit(places[place].position.xyz + offset * places[place].normal.xyz, direction).triangle;
    if (met >= 0 && dot(cross(triangles[3 * met + 1].xyz, triangles[3 * met + 2].xyz), direction) >= 0.0) met = -2;
    hits[ray * place_count + place] = met;
}
