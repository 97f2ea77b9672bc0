#version 430
// What each receiver gets per unit of each harmonic of the light around it, past what hides it from itself: the mean of the
// harmonic over the rays that leave the subject.
// Sloan, Kautz, Snyder 2002, "Precomputed Radiance Transfer for Real-Time Rendering in Dynamic, Low-Frequency Lighting
// Environments", section 4.2, shadowed diffuse transfer.
#include "lib/hemisphere.glsl"
#include "lib/sh.glsl"
layout(local_size_x = 64) in;
struct Receiver {
    vec4 position;
    vec4 normal;
};
layout(std430, binding = 1) readonly buffer Receivers { Receiver receivers[]; };
layout(std430, binding = 2) readonly buffer Hits { int hits[]; };
layout(std430, binding = 3) writeonly buffer Vectors { float vectors[]; };
uniform int receiver_count;
uniform int directions;

void main() {
    int receiver = int(gl_GlobalInvocationID.x);
    if (receiver >= receiver_count) return;
    float[9] sum;
    for (int k = 0; k < 9; ++k) sum[k] = 0.0;
    for (int ray = 0; ray < directions; ++ray) {
        if (hits[ray * receiver_count + receiver] >= 0) continue;
        float[9] basis = sh_basis(cosine_direction(ray, receivers[receiver].normal.xyz));
        for (int k = 0; k < 9; ++k) sum[k] += basis[k];
    }
    for (int k = 0; k < 9; ++k) vectors[k * receiver_count + receiver] = sum[k] / float(directions);
}
