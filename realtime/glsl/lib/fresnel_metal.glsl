#include "lib/fresnel.glsl"

// Fresnel's equations for unpolarised light on a metal of refractive index eta and extinction coefficient k: Moeller 1988, "Optics".
// Each term that is subtracted from its like is smaller than it: nothing but rounding makes a root's argument negative.
vec3 F_conductor(float cos_i, vec3 eta, vec3 k) {
    float cos2 = cos_i * cos_i, sin2 = 1.0 - cos2;
    vec3 t = eta * eta - k * k - sin2;
    vec3 ab = sqrt(t * t + 4.0 * eta * eta * k * k);  // a^2 + b^2, with a + i b the index's cosine behind the surface
    vec3 a = sqrt(max(0.5 * (ab + t), 0.0));
    vec3 s = (ab + cos2 - 2.0 * a * cos_i) / (ab + cos2 + 2.0 * a * cos_i);
    vec3 p = (ab * cos2 + sin2 * sin2 - 2.0 * a * cos_i * sin2) / (ab * cos2 + sin2 * sin2 + 2.0 * a * cos_i * sin2);
    return 0.5 * s * (1.0 + p);
}

// Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering", equation 15: F0 is what is reflected straight back.
vec3 F_schlick(float cos_i, vec3 F0) {
    return F0 + (1.0 - F0) * schlick_weight(cos_i);
}

// Lazanyi & Szirmay-Kalos 2005, "Fresnel Term Approximations for Metals": a metal dips before it rises, by a term of its own. Its
// exponent is 6 and `dip` such that it is right at 1/7, the dip of most metals: Hoffman 2019, "Fresnel Equations Considered
// Harmful".
vec3 F_lazanyi(float cos_i, vec3 F0, vec3 dip) {
    return F_schlick(cos_i, F0) - dip * (cos_i * clamp(1.0 - cos_i, 0.0, 1.0) * schlick_weight(cos_i));
}
