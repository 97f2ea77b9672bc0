#include "lib/fresnel.glsl"
#include "lib/fresnel_metal.glsl"
#include "lib/ggx.glsl"

struct Burley {
    vec3 base_color;
    float roughness;
    float metallic;
    float ior;             // 2 / (1 - sqrt(0.08 specular)) - 1
    float clearcoat;
    float clearcoat_gloss;
    float sheen;
};

// Burley 2012, "Physically-Based Shading at Disney", section 5.4: the clear coat's distribution, generalised Trowbridge and Reitz
// with exponent 1, whose tail is longer than that of GGX. As there, the sine comes from the cross product.
float D_gtr1(vec3 N, vec3 H, float alpha) {
    vec3 sine = cross(N, H);
    float cosine = dot(N, H), a2 = alpha * alpha;
    return (a2 - 1.0) / (3.14159265358979 * log(a2) * (dot(sine, sine) + a2 * cosine * cosine));
}

// Section 5.3: what the base returns over what a Lambertian surface does, darker at grazing angles if it is smooth, brighter back
// towards the light if it is rough. cos_d is that between either direction and the half vector.
float burley_diffuse(float cos_i, float cos_o, float cos_d, float roughness) {
    float retro = 2.0 * roughness * cos_d * cos_d, i = schlick_weight(cos_i), o = schlick_weight(cos_o);
    return (1.0 - 0.5 * i) * (1.0 - 0.5 * o) + retro * (i + o + i * o * (retro - 1.0));
}

// A coat of index 1.5 and strength 0.25, as in section 5.4; see ggx_reflection. Its shadowing is that of roughness 0.25, and as in
// Mitsuba's port it is not divided by the four cosines that a facet's reflection spreads by.
float clearcoat_reflection(vec3 N, vec3 V, vec3 L, vec3 H, float alpha) {
    float cos_i = dot(N, V), cos_o = dot(N, L), F = 0.04 + 0.96 * schlick_weight(dot(V, H));
    float G = 4.0 * cos_i * cos_o * V1_smith(cos_i, 0.25) * V1_smith(cos_o, 0.25);
    return 0.25 * F * D_gtr1(N, H, alpha) * G * cos_o;
}

// Radiance towards V per unit of irradiance on a plane that faces L. The base's own highlight has Fresnel's exact term where it is
// no metal; sheen is white. Both directions must lie above the horizon. `wider` is added to the square of each highlight's alpha; at 1 that
// of the coat would be 0 / 0.
vec3 burley_reflection(Burley m, vec3 N, vec3 V, vec3 L, vec3 H, float wider) {
    float cos_d = clamp(dot(V, H), 0.0, 1.0), cos_o = dot(N, L), dielectric = 1.0 - m.metallic;
    float alpha = max(m.roughness * m.roughness, 0.001), coat = mix(0.1, 0.001, m.clearcoat_gloss);
    vec3 F = dielectric * F_dielectric(cos_d, m.ior) + m.metallic * F_schlick(cos_d, m.base_color);
    vec3 value = F * ggx_reflection(N, V, L, H, sqrt(alpha * alpha + wider));
    value += m.clearcoat * clearcoat_reflection(N, V, L, H, min(sqrt(coat * coat + wider), 0.999));
    vec3 diffuse = m.base_color / 3.14159265358979 * burley_diffuse(dot(N, V), cos_o, cos_d, m.roughness);
    return value + dielectric * cos_o * (diffuse + m.sheen * schlick_weight(cos_d));
}
