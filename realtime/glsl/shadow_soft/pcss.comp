#version 430
// The whole light from the distances around its centre. Fernando 2005, "Percentage-Closer Soft Shadows", section 2: the mean
// distance of what blocks the light, then a filter as wide as the penumbra that the light has behind it.
//
// Two biases of the original are mended in the search. What it finds blocks the light only within the cone that narrows from
// the light to the receiver, so the rest does not count. And a blocker fills more of that cone the closer it is to the
// receiver, where a search of even density would miss it: the search is dense in its middle, and what it finds is weighted by
// the part of the light that it hides.
#include "shadow_soft/receive.glsl"
#include "lib/vogel.glsl"
uniform float radius;
uniform float nearest;  // distance of what is nearest to the light's centre

float blocker_distance(Receiver r, vec3 axis, vec3 x, vec3 y, float turn) {
    // As wide as the cone is, seen from the light, at the distance of the nearest surface.
    float search = radius * max(1.0 / nearest - 1.0 / r.distance, 0.0);
    float sum = 0.0, weights = 0.0;
    for (int i = 0; i < BLOCKER_TAPS; ++i) {
        vec2 p = vogel_point(i, BLOCKER_TAPS, turn);
        float spread = dot(p, p);
        vec2 d = search * spread * p;
        vec3 u = normalize(axis + d.x * x + d.y * y);
        vec3 q = distance_along(u) * u;
        float along = dot(q, axis);
        float cone = radius * (1.0 - along / r.distance) + 0.5 * r.texel;
        if (along > r.distance - r.texel || distance(q, along * axis) > cone) continue;
        if (dot(r.normal, q - r.v) <= r.texel) continue;
        // What the tap stands for, an area that grows as spread², over the area of the cone.
        float part = along / cone;
        float weight = part * part * spread * spread;
        sum += weight * along;
        weights += weight;
    }
    return weights > 0.0 ? sum / weights : r.distance;
}

float seen_part(Receiver r, float height, ivec2 pixel) {
    float above = part_above_horizon(height, radius);
    if (above == 0.0) return 0.0;
    vec3 axis = r.v / r.distance;
    vec3 x = normalize(cross(axis, abs(axis.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
    vec3 y = cross(axis, x);
    // Neighbouring samples turn the taps differently, so that a pixel has many more of them. Jimenez 2014, "Next Generation
    // Post Processing in Call of Duty: Advanced Warfare": interleaved gradient noise.
    float turn = 6.28318530717959 * fract(52.9829189 * fract(dot(vec2(pixel), vec2(0.06711056, 0.00583715))));
    float blocker = blocker_distance(r, axis, x, y, turn);
    float width = radius * (r.distance / blocker - 1.0);
    if (width == 0.0) return above * lit_part(r, r.v);
    float lit = 0.0;
    for (int i = 0; i < FILTER_TAPS; ++i) {
        vec2 d = width * vogel_point(i, FILTER_TAPS, turn);
        lit += lit_part(r, r.v + d.x * x + d.y * y);
    }
    return above * lit / float(FILTER_TAPS);
}
