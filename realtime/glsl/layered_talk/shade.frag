#version 430
// NVIDIA's suit of 2005: diffuse light with a broad, noisy highlight; sharp metal; a silhouette of metal. Two Blinn-Phong lobes
// each. Every number is one of `amounts`, driven by three textures; its place there has the number's name.
#include "lib/beam.glsl"
#include "lib/blinn_phong.glsl"
#include "lib/light_spread.glsl"
#include "lib/suit_talk.glsl"
layout(std430, binding = 3) readonly buffer Lights { Light lights[]; };
layout(std430, binding = 4) readonly buffer Amounts { vec4 amounts[]; };
uniform int light_count;
uniform float damping;
uniform float spread;
uniform sampler2D diffuse_map;
uniform sampler2D specular_map;
uniform sampler2D alpha_map;
uniform sampler2D noise_map;
uniform sampler2D emission_map;
uniform vec3 emission;
uniform vec3 eye;
in vec3 position;
in vec3 normal;
in vec2 uv;
layout(location = 0) out vec4 radiance;

vec4 special = vec4(1.0, 0.0, 0.0, 0.0);  // driven by no texture until main() has read them
float amount(int which) { return driven(special, amounts[which]); }

// Two lobes whose numbers begin at `first`: strength and exponent of each, tint by red and blue, slope of their self-shadowing.
vec3 highlights(int first, vec3 N, vec3 L, vec3 V, float wide) {
    float sum = 0.0;
    for (int k = 0; k < 2; ++k) {
        float n = widened_exponent(max(amount(first + 2 * k + 1), 1.0), wide);
        sum += amount(first + 2 * k) * blinn_phong_normalisation(n) * blinn_phong(N, L, V, n);
    }
    return vec3(amount(first + 4), 1.0, amount(first + 5)) * sum * self_shadowing(dot(N, L), amount(first + 6));
}

void main() {
    vec3 seen = vec3(0.0), N = normalize(normal), V = normalize(eye - position);
    if (gl_FrontFacing) {
        vec3 pigment = textureLod(diffuse_map, uv, 0.0).rgb;
        special = vec4(1.0, pigment.g, textureLod(specular_map, uv, 0.0).g, textureLod(alpha_map, uv, 0.0).g);
        float noise = 1.0 + amount(LAYER1_NOISE) * (2.0 * textureLod(noise_map, uv * NOISE_REPEATS, 0.0).r - 1.0);
        vec4 cubic = vec4(amount(RAMP_0), amount(RAMP_1), amount(RAMP_2), amount(RAMP_3));
        float alpha3 = silhouette_ramp(dot(N, V), cubic) * silhouette_damping(dot(N, V), damping);
        float alpha2 = clamp(amount(LAYER2_ALPHA), 0.0, 1.0);
        seen = emission * textureLod(emission_map, uv, 0.0).rgb;
        for (int i = 0; i < light_count; ++i) {
            Beam beam = beam_of(lights[i], position);
            vec3 L = -beam.travel;
            float wide = spread * light_spread(lights[i], position);
            vec3 layer1 = amount(LAYER1_DIFFUSE) * pigment / PI * max(dot(N, L), 0.0)
                + noise * highlights(LAYER1_STRENGTH_1, N, L, V, wide);
            vec3 layer2 = highlights(LAYER2_STRENGTH_1, N, L, V, wide);
            vec3 layer3 = highlights(LAYER3_STRENGTH_1, N, L, V, wide);
            seen += beam.irradiance * composited(composited(layer1, layer2, alpha2), layer3, alpha3);
        }
    }
    radiance = vec4(seen, 1.0);
}
