#version 430
// Light that travels along one ordinate, carried through the grid plane by plane: a work group for each, whose threads have EACH x EACH
// cells of a plane, SIDE apart. Inside a cell what hair sends is
// constant (step characteristics: Lewis & Miller 1984, "Computational Methods of Neutron Transport", section 4-3).
// A bundle of rays crosses the skin in several cells, a part of it in each. What is carried is the light of those rays that are outside the
// body, where hair is, and in w the part that has crossed: above 0 outwards, below 0 inwards.
// With SKY_ALONE neither hair nor skin sends any; without SHADOWED hair takes none.
#include "lib/step_characteristic.glsl"
#include "hair_light/extinction.glsl"
#include "hair_light/ordinates.glsl"
#include "hair_light/rows.glsl"
layout(local_size_x = SIDE, local_size_y = SIDE) in;
layout(std430, binding = 1) writeonly buffer Along { vec4 along[]; };  // w: part of it that comes to the skin
#ifndef SKY_ALONE
layout(std430, binding = 5) readonly buffer Sent { vec4 sent[]; };
#endif
shared vec4 plane[CELLS * CELLS];

vec4 on_plane(ivec2 at, vec4 sky) {
    return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, ivec2(CELLS))) ? plane[at.y * CELLS + at.x] : sky;
}

// The bundle where the skin of a cell, that sends `radiance`, crosses `part` of it.
vec4 crossing_skin(vec4 bundle, float cosine, float part, vec3 radiance) {
    if (part > 0.0 && cosine < 0.0) return vec4(bundle.rgb, -min(max(-bundle.w, 0.0) + part, 1.0));
    vec3 outside = bundle.rgb * (1.0 + min(bundle.w, 0.0));  // what has gone in is lost
    if (part == 0.0) return vec4(outside, 0.0);
    float before = max(bundle.w, 0.0);
    return vec4(mix(outside, radiance, part / (before + part)), min(before + part, 1.0));
}

void main() {
    int ordinate = int(gl_WorkGroupID.x);
    vec3 direction = ordinates[ordinate].travel_weight.xyz, sky = ordinates[ordinate].sky.rgb;
    vec3 size = cell_size(), cells_crossed = direction / size, a = abs(cells_crossed);
    int k = a.x >= a.y && a.x >= a.z ? 0 : (a.y >= a.z ? 1 : 2), kx = (k + 1) % 3, ky = (k + 2) % 3;
    vec2 slope = vec2(cells_crossed[kx], cells_crossed[ky]) / a[k];
    vec2 part = ceil(slope) - slope;
    float path = 1.0 / a[k], volume = size.x * size.y * size.z;
    vec4 air = vec4(sky, 0.0), bundles[EACH * EACH];
    for (int c = 0; c < EACH * EACH; ++c) {
        ivec2 at = ivec2(gl_LocalInvocationID.xy) + SIDE * ivec2(c % EACH, c / EACH);
        if (all(lessThan(at, ivec2(CELLS)))) plane[at.y * CELLS + at.x] = air;
    }
    barrier();
    for (int i = 0; i < CELLS; ++i) {
        for (int c = 0; c < EACH * EACH; ++c) {
            ivec2 from = ivec2(gl_LocalInvocationID.xy) + SIDE * ivec2(c % EACH, c / EACH) - ivec2(ceil(slope));
            bundles[c] = mix(mix(on_plane(from, air), on_plane(from + ivec2(1, 0), air), part.x),
                             mix(on_plane(from + ivec2(0, 1), air), on_plane(from + ivec2(1, 1), air), part.x), part.y);
        }
        barrier();
        for (int c = 0; c < EACH * EACH; ++c) {
            ivec2 at = ivec2(gl_LocalInvocationID.xy) + SIDE * ivec2(c % EACH, c / EACH);
            if (any(greaterThanEqual(at, ivec2(CELLS)))) continue;
            ivec3 cell;
            cell[k] = cells_crossed[k] > 0.0 ? i : CELLS - 1 - i;
            cell[kx] = at.x;
            cell[ky] = at.y;
            int index = cell_index(cell);
            vec4 skin = rows[index].skin, hair = texelFetch(across, cell, 0);
            float cosine = dot(skin.xyz, direction);
            vec3 from_skin = vec3(0.0), from_hair = vec3(0.0);
#ifndef SKY_ALONE
            from_skin = rows[index].radiance.rgb;
            from_hair = sent[ordinate * CELLS * CELLS * CELLS + index].rgb;
#endif
            vec4 bundle = crossing_skin(bundles[c], cosine, abs(cosine) * skin.w * path / volume, from_skin);
            vec3 mean = bundle.rgb, leaving = bundle.rgb;
            if (hair.x > 0.0) {
                float extinction = float(SHADOWED) * hair_extinction(hair, texelFetch(between, cell, 0).xyz, direction);
                vec3 emitted = extinction * from_hair;
                float others = rows[index].hair.w;
                mean = step_characteristic(bundle.rgb, others * emitted, vec3(others * extinction), path).mean;
                leaving = step_characteristic(bundle.rgb, emitted, vec3(extinction), path).leaving;
            }
            plane[at.y * CELLS + at.x] = vec4(leaving, bundle.w);
            float sum = mean.r + mean.g + mean.b;
            bool is_lit = sum > 1e-30;  // less may be a denormal, whose inverse is infinite
            along[ordinate * CELLS * CELLS * CELLS + index] = vec4(mean, is_lit ? (leaving.r + leaving.g + leaving.b) / sum : 1.0);
        }
        barrier();
    }
}
