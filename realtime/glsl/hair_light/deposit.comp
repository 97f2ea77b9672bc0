#version 430
// Hair into the cells: the segment between each sample and the next, in pieces that are no longer than half a cell.
#include "hair/samples.glsl"
#include "hair/strands.glsl"
#include "hair_light/grid.glsl"
#include "hair_light/sums.glsl"
layout(std430, binding = 1) buffer Systems { int cell_hair[]; };  // 1 + the hair of the scene that is in a cell, the last of several
layout(local_size_x = 64) in;
uniform int count;
uniform int per_hair;
uniform float area_scale;

const int MOST_PIECES = 64;

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count || i % per_hair + 1 == per_hair) return;
    vec4 from = samples[i].position_radius;
    vec3 way = samples[i + 1].position_radius.xyz - from.xyz, size = cell_size(), crossed = abs(way) / size;
    if (way == vec3(0.0)) return;
    int pieces = clamp(int(ceil(2.0 * max(crossed.x, max(crossed.y, crossed.z)))), 1, MOST_PIECES);
    float area = area_scale * 2.0 * from.w * length(way) / float(pieces);
    for (int piece = 0; piece < pieces; ++piece) {
        float t = (float(piece) + 0.5) / float(pieces);
        vec3 T = mix(samples[i].tangent.xyz, samples[i + 1].tangent.xyz, t);
        T = normalize(dot(T, T) > 1e-12 ? T : way);  // where a hair turns back, opposite tangents leave none
        int index = cell_index(cell_at(from.xyz + t * way)), first = SUMS * index;
        atomicAdd(sums[first + AREA], int(round(area)));
        for (int c = 0; c < 3; ++c) {
            atomicAdd(sums[first + TANGENT + c], int(round(area * T[c])));
            atomicAdd(sums[first + MOMENT + c], int(round(area * T[c] * T[c])));
            atomicAdd(sums[first + MOMENT + 3 + c], int(round(area * T[c / 2] * T[1 + (c + 1) / 2])));
        }
        atomicMax(cell_hair[index], 1 + int(strand_colors[i / per_hair].w));
    }
}
