#version 430
// Light that is scattered for the first time: what each cell's hair sends along each ordinate, and the irradiance on the cell's skin.
// Light on hair is the mean over eight places, each weighted by the hair that is there.
#include "hair_light/light.glsl"
#include "hair_light/ordinates.glsl"
#include "hair_light/rows.glsl"
#include "hair_light/scattering.glsl"
layout(std430, binding = 0) buffer Sources { vec4 sources[]; };  // 0 before
layout(local_size_x = 64) in;
uniform float radius;

const float OFF_MIDDLE = 0.288675;  // sqrt(1 / 12) cells: Gauss' two places

Lit light_on_cell(int index, vec3 middle, vec3 size, vec3 outside, vec3 tangent) {
    vec3 sum = vec3(0.0), travel = vec3(0.0);
    float weights = 0.0;
    for (int k = 0; k < 8; ++k) {
        vec3 p = middle + OFF_MIDDLE * size * (2.0 * vec3(k & 1, k >> 1 & 1, k >> 2) - 1.0);
        float weight = textureLod(across, (p - grid_corner()) / (size * float(CELLS)), 0.0).x;
        if (weight == 0.0) continue;
        Lit lit = light_on_hair(index, p, outside, tangent, radius, vec3(0.0));
        sum += weight * lit.irradiance;
        travel += weight * lit.to_light;
        weights += weight;
    }
    return weights > 0.0 ? Lit(normalize(travel), sum / weights) : Lit(vec3(0.0, 1.0, 0.0), vec3(0.0));
}

// What hair sends of a light along an ordinate, per unit of the light across its beam.
vec3 sent_along(int ordinate, Cell cell, vec3 to_light) {
    return fibre_scattering(int(cell.hair.z), cell.tangent.xyz, ordinates[ordinate].travel_weight.xyz, to_light);
}

// What that is scaled by. Few directions hit or miss a lobe: what they get in all is known.
vec3 balance(Cell cell, vec3 to_light) {
    vec3 all = vec3(0.0);
    for (int k = 0; k < ORDINATES; ++k) {
        vec4 ordinate = ordinates[k].travel_weight;
        all += FOUR_PI * ordinate.w * length(cross(cell.tangent.xyz, ordinate.xyz)) * sent_along(k, cell, to_light);
    }
    float along = dot(cell.tangent.xyz, to_light), sine = sqrt(max(1.0 - along * along, 0.0));
    return sine * fibre_whole(int(cell.hair.z), ALL, along) / max(all, 1e-6);
}

void main() {
    int index = int(gl_GlobalInvocationID.x), cells = CELLS * CELLS * CELLS;
    if (index >= cells) return;
    Cell cell = rows[index];
    vec3 size = cell_size(), middle = grid_corner() + (vec3(cell_of(index)) + 0.5) * size;
    vec3 outside = 0.5 * dot(abs(cell.skin.xyz), size) * cell.skin.xyz;  // skin in the cell is no deeper than that below its middle
    vec3 irradiance = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        if (cell.skin.w > 0.0) {
            float cosine = dot(cell.skin.xyz, -beam_of(lights[i], middle).travel);
            if (cosine > 0.0)
                irradiance += cosine * light_on_hair(i, middle, outside, cell.skin.xyz, 0.0, vec3(0.0)).irradiance;
        }
        if (cell.hair.x == 0.0) continue;
        Lit lit = light_on_cell(i, middle, size, outside, cell.tangent.xyz);
        if (all(equal(lit.irradiance, vec3(0.0)))) continue;
        vec3 balanced = lit.irradiance * balance(cell, lit.to_light);
        for (int k = 0; k < ORDINATES; ++k) sources[k * cells + index].rgb += balanced * sent_along(k, cell, lit.to_light);
    }
    rows[index].irradiance = vec4(irradiance, 0.0);
}
