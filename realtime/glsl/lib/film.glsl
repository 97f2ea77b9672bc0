#include "lib/fresnel.glsl"

// A Lambertian surface under a smooth clear film of index `ior`: reflected radiance per unit of irradiance on the film, without
// what the film itself mirrors. Light that the film throws back inward meets the pigment again, and is coloured at each return:
// Saunderson 1942, "Calculation of the Color of Pigmented Plastics". `internal` is the part of diffuse light thrown back.
vec3 film_brdf(vec3 albedo, float cos_i, float cos_o, float ior, float internal) {
    float through = (1.0 - F_dielectric(cos_i, ior)) * (1.0 - F_dielectric(cos_o, ior));
    return through * albedo / (3.14159265358979 * ior * ior * (1.0 - internal * albedo));
}
