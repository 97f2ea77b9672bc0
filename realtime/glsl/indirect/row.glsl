// One workgroup works out what one receiver gets from every surfel: the weights by which the surfels' radiance adds up to the
// mean radiance that the receiver sees, cosine-weighted. Outgoing radiance is albedo times that mean.
//
// A receiver of the surroundings gets form factors over their sum. One of the subject, where the subject is not convex, gets
// the surroundings that it sees past the subject; the part of its hemisphere that the subject hides is filled with the mean
// of the subject's own surfels that it sees.
#include "lib/receive.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 6) readonly buffer Bits { uint bits[]; };
uniform int surfel_count;
uniform int surroundings;
uniform float closed;
uniform int words;  // 0: nothing is known of what hides what, so nothing is hidden

shared vec3 lanes[64];

// Sum over the workgroup.
vec3 reduced(vec3 value) {
    uint lane = gl_LocalInvocationID.x;
    lanes[lane] = value;
    for (uint half_size = 32u; half_size > 0u; half_size /= 2u) {
        barrier();
        if (lane < half_size) lanes[lane] += lanes[lane + half_size];
    }
    barrier();
    vec3 sum = lanes[0];
    barrier();
    return sum;
}

struct Row {
    vec3 position;
    vec3 normal;
    int receiver;  // among the receivers whose visibility is known, or -1
    float around;  // weight of a form factor with the surroundings
    float own;     // weight of a form factor with the subject
};

bool sees(Row row, int surfel) {
    return row.receiver < 0 || (bits[row.receiver * words + surfel / 32] & (1u << (surfel % 32))) != 0u;
}

Row make_row(vec3 position, vec3 normal, int receiver) {
    Row row = Row(position, normal, words > 0 ? receiver : -1, 0.0, 0.0);
    vec3 sums = vec3(0.0);  // the surroundings, the part of them that is seen, the subject's surfels that are seen
    for (int i = int(gl_LocalInvocationID.x); i < surfel_count; i += 64) {
        float factor = surfel_factor(surfels[i], position, normal);
        bool is_seen = sees(row, i);
        if (i < surroundings) sums.xy += vec2(factor, is_seen ? factor : 0.0);
        else if (is_seen) sums.z += factor;
    }
    sums = reduced(sums);
    if (row.receiver < 0) {
        row.around = row.own = 1.0 / closure_scale(sums.x + sums.z, closed);
    } else {
        row.around = 1.0 / closure_scale(sums.x, closed);
        row.own = sums.z > 0.0 ? (sums.x - sums.y) * row.around / sums.z : 0.0;
    }
    return row;
}

float row_weight(Row row, int surfel) {
    if (!sees(row, surfel)) return 0.0;
    return surfel_factor(surfels[surfel], row.position, row.normal) * (surfel < surroundings ? row.around : row.own);
}
