// Blinn 1977, "Models of Light Reflection for Computer Synthesized Pictures": the highlight about the half vector. Rounding may
// leave N.H a little above 1, which a power of thousands would not forgive.
float blinn_phong(vec3 N, vec3 L, vec3 to_eye, float exponent) {
    vec3 H = normalize(L + to_eye);
    return pow(clamp(dot(N, H), 0.0, 1.0), exponent);
}
