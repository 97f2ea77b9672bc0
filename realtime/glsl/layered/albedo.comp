#version 430
// The part of even light that a layered material sends to each cosine of the view, as the mean over its chart. Directions
// are chosen by their cosine to the normal and by facets of three roughnesses, weighted by the balance heuristic: Veach and
// Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering"; Walter et al. 2007, equations 14, 35.
#include "layered/material.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Albedos { vec4 albedos[]; };
layout(std430, binding = 1) readonly buffer Points { vec4 points[]; };
const float ALPHAS[3] = float[](0.02, 0.1, 0.4);

void main() {
    int row = int(gl_GlobalInvocationID.x);
    if (row >= COSINES) return;
    float cos_i = (float(row) + 0.5) / float(COSINES);
    vec3 V = vec3(sqrt(1.0 - cos_i * cos_i), 0.0, cos_i), N = vec3(0.0, 0.0, 1.0), sum = vec3(0.0);
    for (int i = 0; i < POINTS; ++i) {
        float ratio = sqrt(points[i].x / (1.0 - points[i].x)), angle = 6.28318530717959 * points[i].y;
        for (int way = -1; way < 3; ++way) {
            float tangent = way < 0 ? ratio : ALPHAS[way] * ratio, cosine = inversesqrt(1.0 + tangent * tangent);
            vec3 drawn = vec3(tangent * cosine * vec2(cos(angle), sin(angle)), cosine);
            vec3 L = way < 0 ? drawn : reflect(-V, drawn);
            if (L.z <= 0.0) continue;
            vec3 H = normalize(V + L);
            float density = L.z / 3.14159265358979;
            for (int k = 0; k < 3; ++k) density += D_ggx(N, H, ALPHAS[k]) * H.z / (4.0 * dot(V, H));
            sum += layered_reflection(points[i].zw, N, V, L, 0.0) / density;
        }
    }
    albedos[row] = vec4(sum / float(POINTS), 1.0);
}
