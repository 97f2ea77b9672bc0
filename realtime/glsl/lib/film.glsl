#include "lib/fresnel.glsl"

// What a Lambertian base returns through a clear film of index `ior`: radiance per unit of irradiance on the film, without what the
// film itself mirrors. `entering` and `leaving` are the parts that get through the film from either direction, `internal` that of
// diffuse light which it throws back to the base, where the pigment colours it once more: Saunderson 1942, "Calculation of the Color
// of Pigmented Plastics".
vec3 below_film(vec3 albedo, float entering, float leaving, float ior, float internal) {
    return albedo * (entering * leaving / (3.14159265358979 * ior * ior)) / (1.0 - internal * albedo);
}

// The same through a smooth film.
vec3 film_brdf(vec3 albedo, float cos_i, float cos_o, float ior, float internal) {
    return below_film(albedo, 1.0 - F_dielectric(cos_i, ior), 1.0 - F_dielectric(cos_o, ior), ior, internal);
}
