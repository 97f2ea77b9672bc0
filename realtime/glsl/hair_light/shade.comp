#version 430
// Radiance that points on hairs send to the sensor, mean over the fibre's width: light straight from the lights, and with SCATTERED what
// comes along the ordinates, scattered before or from the sky.
#include "hair/samples.glsl"
#include "hair/strands.glsl"
#include "hair_light/light.glsl"
#include "hair_light/scattering.glsl"
#ifdef KAJIYA
#include "hair_light/kajiya.glsl"
#endif
layout(std430, binding = 0) writeonly buffer Radiance { vec4 hair_radiance[]; };
#ifdef SCATTERED
#include "hair_light/ordinates.glsl"
layout(std430, binding = 1) readonly buffer Along { vec4 along[]; };
#endif
layout(local_size_x = 64) in;
uniform int count;
uniform int per_hair;
uniform vec3 eye;

vec3 scattered(int hair, vec3 tangent, vec3 to_eye, vec3 to_light) {
#ifdef KAJIYA
    return kajiya_scattering(hair, tangent, to_eye, to_light);
#else
    return fibre_scattering(hair, tangent, to_eye, to_light);
#endif
}

#ifdef SCATTERED
// Light that comes along the ordinates, between the cells around a point that hold hair. Few directions do not integrate a lobe
// exactly: what they should add up to is known, the albedo.
vec3 gathered(int hair, vec3 position, vec3 tangent, vec3 to_eye) {
    vec3 at = (position - grid_corner()) / cell_size() - 0.5;
    ivec3 low = ivec3(floor(at));
    int index[8];
    float weight[8], weights = 0.0;
    for (int c = 0; c < 8; ++c) {
        ivec3 corner = ivec3(c & 1, c >> 1 & 1, c >> 2), cell = clamp(low + corner, ivec3(0), ivec3(CELLS - 1));
        vec3 part = mix(1.0 - (at - vec3(low)), at - vec3(low), vec3(corner));
        index[c] = cell_index(cell);
        weight[c] = texelFetch(across, cell, 0).x > 0.0 ? part.x * part.y * part.z : 0.0;
        weights += weight[c];
    }
    vec3 sum = vec3(0.0), kernel = vec3(0.0);
    for (int k = 0; k < ORDINATES; ++k) {
        vec4 ordinate = ordinates[k].travel_weight;
        vec3 part = FOUR_PI * ordinate.w * scattered(hair, tangent, to_eye, -ordinate.xyz), coming = vec3(0.0);
        for (int c = 0; c < 8; ++c) coming += weight[c] * along[k * CELLS * CELLS * CELLS + index[c]].rgb;
        sum += part * coming;
        kernel += part;
    }
    return weights > 0.0 ? fibre_whole(hair, ALBEDO, dot(tangent, to_eye)) * sum / (weights * max(kernel, 1e-6)) : vec3(0.0);
}
#endif

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) return;
    int hair = int(strand_colors[i / per_hair].w);
    vec4 at = samples[i].position_radius;
    vec3 tangent = samples[i].tangent.xyz, to_eye = normalize(eye - at.xyz), sum = vec3(0.0);
    for (int k = 0; k < light_count; ++k) {
        Lit lit = light_on_hair(k, at.xyz, vec3(0.0), tangent, at.w, to_eye);
        if (any(greaterThan(lit.irradiance, vec3(0.0)))) sum += lit.irradiance * scattered(hair, tangent, to_eye, lit.to_light);
    }
#ifdef SCATTERED
    sum += gathered(hair, at.xyz, tangent, to_eye);
#endif
    hair_radiance[i] = vec4(sum, 0.0);
}
