#version 430
// What each vertex of a subject that is not convex receives: the light around it through its transfer, and what the subject's
// own surfels reflect that its rays hit.
#include "indirect_grid/interpolate.glsl"
layout(local_size_x = 64) in;
struct Receiver {
    vec4 position;
    vec4 normal;
};
layout(std430, binding = 0) readonly buffer Receivers { Receiver receivers[]; };
layout(std430, binding = 1) readonly buffer Reflected { vec4 reflected[]; };
layout(std430, binding = 3) readonly buffer Vectors { float vectors[]; };
layout(std430, binding = 4) writeonly buffer Received { vec4 received[]; };
layout(std430, binding = 5) readonly buffer Hits { int hits[]; };
uniform int first;
uniform int surroundings;
uniform int receiver_count;
uniform int directions;

void main() {
    int receiver = first + int(gl_GlobalInvocationID.x);
    if (receiver >= receiver_count) return;
    vec3[9] harmonics = harmonics_at(receivers[receiver].position.xyz);
    vec3 around = vec3(0.0), own = vec3(0.0);
    for (int k = 0; k < 9; ++k) around += vectors[k * receiver_count + receiver] * harmonics[k];
    for (int ray = 0; ray < directions; ++ray) {
        int hit = hits[ray * receiver_count + receiver];
        if (hit >= 0) own += reflected[surroundings + hit].rgb;
    }
    received[receiver - first] = vec4(max(around, 0.0) + own / float(directions), 1.0);
}
