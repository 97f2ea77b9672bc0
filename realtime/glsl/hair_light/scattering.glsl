// What a fibre sends to the eye, mean over its width, per unit of irradiance across the beam: the float64 twin is in realtime/fibre.py.
#include "lib/fibre.glsl"
#include "hair_light/tables.glsl"

const float HALF_PI = 1.57079632679490;

vec3 fibre_entry(int hair, int layer, float cos_i, float azimuth) {
    vec2 size = vec2(textureSize(fibre_table, 0).xy);
    vec2 at = vec2(azimuth / (2.0 * HALF_PI), acos(min(cos_i, 1.0)) / HALF_PI) * (size - 1.0) + 0.5;
    return textureLod(fibre_table, vec3(at / size, float(LAYERS * hair + layer)), 0.0).rgb;
}

// ALBEDO: part of even light from everywhere that a fibre sends to an eye; ALL: part of light from there that it sends anywhere.
vec3 fibre_whole(int hair, int which, float sin_i) {
    return fibre_entry(hair, which, sqrt(max(1.0 - sin_i * sin_i, 0.0)), 0.0);
}

vec3 fibre_scattering(int hair, vec3 tangent, vec3 to_eye, vec3 to_light) {
    float sin_i = dot(tangent, to_eye), sin_o = dot(tangent, to_light);
    float cos_i = sqrt(max(1.0 - sin_i * sin_i, 0.0)), cos_o = sqrt(max(1.0 - sin_o * sin_o, 0.0));
    float azimuth = acos(clamp((dot(to_eye, to_light) - sin_i * sin_o) / max(cos_i * cos_o, 1e-8), -1.0, 1.0));
    vec3 sum = vec3(0.0);
    for (int p = 0; p < 4; ++p) {
        vec4 lobe = fibre_constant(hair, p);
        vec2 turned = fibre_tilted(vec2(sin_i, cos_i), lobe.yz);
        sum += fibre_longitudinal(turned.x, turned.y, sin_o, cos_o, lobe.x) * fibre_entry(hair, p, cos_i, azimuth);
    }
    return sum;
}
