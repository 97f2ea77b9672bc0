#version 430
// The rows of the transport matrix of the subject's own surfels: the surroundings through the transfer, from where the surfel
// is itself, and the subject's surfels that its rays hit. A workgroup a row.
#include "lib/sh.glsl"
#include "indirect_grid/seen_from.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) writeonly buffer Transport { float transport[]; };
layout(std430, binding = 2) readonly buffer Hits { int hits[]; };
layout(std430, binding = 3) readonly buffer Vectors { float vectors[]; };
uniform int surroundings;
uniform int surfel_count;
uniform int receiver_count;
uniform int directions;
uniform float closed;

shared float partials[64];

void main() {
    int own = int(gl_WorkGroupID.x), lane = int(gl_LocalInvocationID.x), index = surroundings + own;
    vec3 place = surfels[index].position_area.xyz;
    partials[lane] = 0.0;
    for (int i = lane; i < surroundings; i += 64) partials[lane] += seen_from(place, surfels[i]).w;
    barrier();
    float sum = 0.0;
    for (int i = 0; i < 64; ++i) sum += partials[i];
    for (int i = lane; i < surroundings; i += 64) {
        vec4 seen = seen_from(place, surfels[i]);
        float[9] basis = sh_basis(seen.xyz);
        float response = 0.0;
        for (int k = 0; k < 9; ++k) response += vectors[k * receiver_count + own] * band_factor(k, seen.w) * basis[k];
        transport[i * surfel_count + index] = response * seen.w * sphere_scale(sum, closed);
    }
    for (int i = lane; i < surfel_count - surroundings; i += 64) {
        int count = 0;
        for (int ray = 0; ray < directions; ++ray) count += int(hits[ray * receiver_count + own] == i);
        transport[(surroundings + i) * surfel_count + index] = float(count) / float(directions);
    }
}
