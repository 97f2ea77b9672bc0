// Trilinear interpolation between the eight probes around a place; a place beyond the outermost
// ones gets what they have.
#include "lib/sh.glsl"
#include "indirect_grid/places.glsl"
layout(std430, binding = 2) readonly buffer Coefficients { vec4 coefficients[]; };

vec3[9] harmonics_at(vec3 place) {
    int last = per_side - 1;
    vec3 extent = box_high - box_low;
    vec3 cell = clamp((place - box_low) / max(extent, 1e-30) * float(per_side) - 0.5, 0.0, float(last));
    ivec3 first = clamp(ivec3(cell), ivec3(0), ivec3(max(last - 1, 0)));
    vec3 fraction = cell - vec3(first);
    vec3[9] sum;
    for (int k = 0; k < 9; ++k) sum[k] = vec3(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        ivec3 step = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
        vec3 w = mix(1.0 - fraction, fraction, vec3(step));
        ivec3 at = min(first + step, ivec3(last));
        int probe = at.x + per_side * (at.y + per_side * at.z);
        for (int k = 0; k < 9; ++k) sum[k] += w.x * w.y * w.z * coefficients[9 * probe + k].rgb;
    }
    return sum;
}
