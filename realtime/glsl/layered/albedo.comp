#version 430
// The part of even light that a layered material sends to each cosine of the view, as the mean over its chart. Directions
// are chosen by their cosine to the normal and by facets of three roughnesses, weighted by the balance heuristic: Veach and
// Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering"; Walter et al. 2007, equations 14, 35.
#include "layered/material.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Albedos { vec4 albedos[]; };
layout(std430, binding = 1) readonly buffer Points { vec4 points[]; };
const float ALPHAS[3] = float[](0.02, 0.1, 0.4);

// A direction whose tangent to the normal is given, at a part of the way around it.
vec3 direction(float tangent, float turn) {
    float cosine = inversesqrt(1.0 + tangent * tangent), angle = 6.28318530717959 * turn;
    return vec3(tangent * cosine * vec2(cos(angle), sin(angle)), cosine);
}

// The density of L under all four ways together.
float density(vec3 V, vec3 L) {
    vec3 N = vec3(0.0, 0.0, 1.0), H = normalize(V + L);
    float sum = L.z / 3.14159265358979;
    for (int k = 0; k < 3; ++k) sum += D_ggx(N, H, ALPHAS[k]) * H.z / (4.0 * dot(V, H));
    return sum;
}

void main() {
    int row = int(gl_GlobalInvocationID.x);
    if (row >= COSINES) return;
    float cos_i = (float(row) + 0.5) / float(COSINES);
    vec3 V = vec3(sqrt(1.0 - cos_i * cos_i), 0.0, cos_i), N = vec3(0.0, 0.0, 1.0), sum = vec3(0.0);
    for (int i = 0; i < POINTS; ++i) {
        vec4 at = points[i];
        float ratio = sqrt(at.x / (1.0 - at.x));
        for (int way = -1; way < 3; ++way) {
            vec3 L = way < 0 ? direction(ratio, at.y) : reflect(-V, direction(ALPHAS[way] * ratio, at.y));
            if (L.z > 0.0) sum += layered_reflection(at.zw, N, V, L, 0.0) / density(V, L);
        }
    }
    albedos[row] = vec4(sum / float(POINTS), 1.0);
}
