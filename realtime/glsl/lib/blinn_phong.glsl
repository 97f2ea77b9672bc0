// Blinn 1977, "Models of Light Reflection for Computer Synthesized Pictures": the highlight about the half vector. Rounding may
// leave N.H a little above 1, which a power of thousands would not forgive. Light from straight behind has no half vector
// but rounding, whose square is below 1e-7, and makes no highlight.
float blinn_phong(vec3 N, vec3 L, vec3 to_eye, float exponent) {
    vec3 H = L + to_eye;
    float cosine = dot(N, H) * inversesqrt(max(dot(H, H), 1e-7));
    return cosine > 0.0 ? pow(min(cosine, 1.0), exponent) : 0.0;
}

// Blinn-Phong lobes as normal distributions, n: exponent. Walter et al. 2007, "Microfacet Models for Refraction through Rough
// Surfaces", section 5.2: the roughness of Beckmann's distribution that is nearest to the lobe.
float alpha_of_exponent(float n) { return sqrt(2.0 / (n + 2.0)); }
float exponent_of_alpha(float alpha) { return 2.0 / (alpha * alpha) - 2.0; }

// GGX has a sharper peak and longer tails: the nearest one has this part of Beckmann's roughness, and is still .2 off.
const float GGX_PART = 0.925;

// A lobe made wider, as a GGX of its roughness is made wider by `spread`: roughnesses add as squares, up to 1.
float widened_exponent(float n, float spread) {
    float wide = spread / GGX_PART, alpha = alpha_of_exponent(n);
    return exponent_of_alpha(min(sqrt(alpha * alpha + wide * wide), 1.0));
}

// 1 over the integral of a lobe (N.H)^n over all directions of the light, seen straight on: 8 pi / (n + 2) (1 - 2^(-(n + 2) / 2)).
// Raw, a broad lobe throws back more than what arrives.
float blinn_phong_normalisation(float n) {
    const float PI = 3.14159265358979;
    return (n + 2.0) / (8.0 * PI * (1.0 - exp2(-0.5 * (n + 2.0))));
}
