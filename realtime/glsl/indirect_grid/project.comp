#version 430
// Radiance of the surroundings around each probe in nine harmonics: a workgroup a probe. The sky's own light is direct light
// and left out.
#include "lib/sh.glsl"
#include "indirect_grid/seen_from.glsl"
#include "indirect_grid/places.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Reflected { vec4 reflected[]; };
layout(std430, binding = 2) writeonly buffer Coefficients { vec4 coefficients[]; };
uniform int surroundings;
uniform float closed;

shared vec4 partials[9][64];

void main() {
    int probe = int(gl_WorkGroupID.x), lane = int(gl_LocalInvocationID.x);
    vec3 place = probe_place(probe);
    vec4[9] sums;
    for (int k = 0; k < 9; ++k) sums[k] = vec4(0.0);
    for (int i = lane; i < surroundings; i += 64) {
        Surfel s = surfels[i];
        vec4 seen = seen_from(place, s);
        float[9] basis = sh_basis(seen.xyz);
        vec3 radiance = s.position_area.w > 0.0 ? reflected[i].rgb : vec3(0.0);
        for (int k = 0; k < 9; ++k) sums[k] += seen.w * vec4(band_factor(k, seen.w) * basis[k] * radiance, 1.0);
    }
    for (int k = 0; k < 9; ++k) partials[k][lane] = sums[k];
    barrier();
    if (lane >= 9) return;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 64; ++i) sum += partials[lane][i];
    coefficients[9 * probe + lane] = vec4(sum.rgb * sphere_scale(sum.w, closed), 1.0);
}
