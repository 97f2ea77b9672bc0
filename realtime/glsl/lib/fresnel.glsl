// Fresnel's equations for unpolarised light (Born & Wolf 1999, "Principles of Optics", section 1.5.2): the part that a smooth
// surface reflects. `eta` is the index behind the surface over the one before it; 1 at total reflection.
float F_dielectric(float cos_i, float eta) {
    float cos2_t = 1.0 - (1.0 - cos_i * cos_i) / (eta * eta);
    if (cos2_t <= 0.0) return 1.0;
    float cos_t = sqrt(cos2_t);
    float s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    float p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    return 0.5 * (s * s + p * p);
}

// Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering", equation 15: the weight of grazing light.
float schlick_weight(float cosine) {
    float c = clamp(1.0 - cosine, 0.0, 1.0);
    return c * c * c * c * c;
}

// NVIDIA 2005, the GeForce 7800 GTX demos: fresnel = 0.05 + 0.95 * (1 - saturate(dot(N, -V)))^5. Twice as much as water and
// cornea reflect straight on.
float F_talk(float cos_i) {
    float c = 1.0 - clamp(cos_i, 0.0, 1.0);
    return 0.05 + 0.95 * c * c * c * c * c;
}
