// A layered material: a base, a film on it, flakes of metal over that; realtime/layers.py gives its uniforms and defines.
#include "lib/burley.glsl"
#include "lib/rough_film.glsl"
#ifdef PRINCIPLED
uniform Burley principled;
#else
uniform sampler2D base_map;
uniform sampler2D weight_map_0;
uniform sampler2D weight_map_1;
uniform sampler2D weight_map_2;
uniform sampler2D weight_map_3;
uniform mat4x3 metal_first;   // of each metal a column: eta, or what is reflected straight back
uniform mat4x3 metal_second;  // k, or the dip
uniform vec4 metal_alpha;
uniform sampler2D film_map;
uniform float film_alpha;
uniform float film_ior;
uniform float film_internal;

// The part of light that gets through the film from a direction, between the cosines that are known.
float film_transmittance(float cosine) {
    int last = textureSize(film_map, 0).x - 1;
    float x = clamp(cosine, 0.0, 1.0) * float(last);
    int i = min(int(x), last - 1);
    return mix(texelFetch(film_map, ivec2(i, 0), 0).r, texelFetch(film_map, ivec2(i + 1, 0), 0).r, x - float(i));
}

// The part of the surface that each metal covers.
vec4 covered(vec2 uv) {
    vec4 weights = vec4(0.0);
#if METALS > 0
    weights.x = textureLod(weight_map_0, uv, 0.0).r;
#endif
#if METALS > 1
    weights.y = textureLod(weight_map_1, uv, 0.0).r;
#endif
#if METALS > 2
    weights.z = textureLod(weight_map_2, uv, 0.0).r;
#endif
#if METALS > 3
    weights.w = textureLod(weight_map_3, uv, 0.0).r;
#endif
    return weights;
}

vec3 metal_fresnel(float cos_i, vec3 first, vec3 second) {
#if FRESNEL == 0
    return F_conductor(cos_i, first, second);
#elif FRESNEL == 1
    return F_lazanyi(cos_i, first, second);
#else
    return F_schlick(cos_i, first);
#endif
}
#endif

// Radiance towards V per unit of irradiance on a plane that faces L; nothing unless both lie above the horizon. `wider` is what a
// light's size adds to the square of each highlight's alpha.
vec3 layered_reflection(vec2 uv, vec3 N, vec3 V, vec3 L, float wider) {
    float cos_i = dot(N, V), cos_o = dot(N, L);
    if (cos_i <= 0.0 || cos_o <= 0.0) return vec3(0.0);
    vec3 H = normalize(V + L);
#ifdef PRINCIPLED
    return burley_reflection(principled, N, V, L, H, wider);
#else
    vec3 albedo = textureLod(base_map, uv, 0.0).rgb;
#ifdef FILM
    float alpha = sqrt(film_alpha * film_alpha + wider);
    vec3 below = below_film(albedo, film_transmittance(cos_i), film_transmittance(cos_o), film_ior, film_internal);
    vec3 value = film_reflection(N, V, L, H, alpha, film_ior) + below * cos_o;
#else
    vec3 value = albedo * (cos_o / 3.14159265358979);
#endif
    vec4 weights = covered(uv);
    float cos_d = clamp(dot(V, H), 0.0, 1.0);
    for (int i = 0; i < METALS; ++i) {
        float flakes = ggx_reflection(N, V, L, H, sqrt(metal_alpha[i] * metal_alpha[i] + wider));
        value = mix(value, metal_fresnel(cos_d, metal_first[i], metal_second[i]) * flakes, weights[i]);
    }
    return value;
#endif
}
