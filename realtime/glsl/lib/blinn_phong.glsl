// Blinn 1977, "Models of Light Reflection for Computer Synthesized Pictures": the highlight about the half vector. Rounding may
// leave N.H a little above 1, which a power of thousands would not forgive. Light from straight behind has no half vector
// but rounding, whose square is below 1e-7, and makes no highlight.
float blinn_phong(vec3 N, vec3 L, vec3 to_eye, float exponent) {
    vec3 H = L + to_eye;
    float cosine = dot(N, H) * inversesqrt(max(dot(H, H), 1e-7));
    return cosine > 0.0 ? pow(min(cosine, 1.0), exponent) : 0.0;
}
