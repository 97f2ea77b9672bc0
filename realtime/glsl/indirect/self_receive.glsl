// What a point of a subject that is not convex receives: the surroundings that it sees past itself, and in the part of its
// hemisphere that the subject itself hides, the mean of the subject's surfels that it does see. Returns radiance averaged
// over the hemisphere with the cosine, so outgoing radiance is albedo times this.
#include "lib/receive.glsl"
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Before { vec4 before[]; };
layout(std430, binding = 6) readonly buffer Bits { uint bits[]; };
uniform int surroundings;
uniform int surfel_count;
uniform int words;
uniform float closed;

bool sees(int receiver, int surfel) {
    return (bits[receiver * words + surfel / 32] & (1u << (surfel % 32))) != 0u;
}

vec3 self_received(int receiver, vec3 position, vec3 normal, bool with_sky) {
    vec3 around = vec3(0.0), own = vec3(0.0);
    float all = 0.0, open = 0.0, self = 0.0;
    for (int i = 0; i < surfel_count; ++i) {
        bool is_own = i >= surroundings;
        bool is_visible = sees(receiver, i);
        if (is_own && !is_visible) continue;
        Surfel s = surfels[i];
        float factor = surfel_factor(s, position, normal);
        if (is_own) {
            own += before[i].rgb * factor;
            self += factor;
            continue;
        }
        all += factor;
        if (!is_visible) continue;
        open += factor;
        if (with_sky || s.position_area.w > 0.0) around += before[i].rgb * factor;
    }
    float scale = closure_scale(all, closed);
    vec3 reflected = self > 0.0 ? own / self : vec3(0.0);
    return around / scale + reflected * (all - open) / scale;
}
