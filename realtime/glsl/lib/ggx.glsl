// Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces", equation 33: the distribution of facet normals
// that is also Trowbridge and Reitz's. The sine of the angle between N and H comes from their cross product: 1 - dot(N, H)^2
// has lost it in single precision where alpha is small, and is 39 % wrong at 0.001.
float D_ggx(vec3 N, vec3 H, float alpha) {
    vec3 sine = cross(N, H);
    float cosine = dot(N, H), a2 = alpha * alpha;
    float spread = dot(sine, sine) + a2 * cosine * cosine;
    return a2 / (3.14159265358979 * spread * spread);
}

// The same, equation 34, over 2 cosines: Smith's shadowing of facets seen along one direction. As a quotient it would be 0 / 0 at
// the horizon.
float V1_smith(float cosine, float alpha) {
    float a2 = alpha * alpha;
    return 1.0 / (cosine + sqrt(a2 + (1.0 - a2) * cosine * cosine));
}

// Light that facets mirror, but for Fresnel's term: radiance towards V per unit of irradiance on a plane that faces L, with separable
// shadowing (Walter et al. 2007, equations 20 and 23). Both directions must lie above the horizon.
float ggx_reflection(vec3 N, vec3 V, vec3 L, vec3 H, float alpha) {
    float cos_o = dot(N, L);
    float shadowing = V1_smith(dot(N, V), alpha) * V1_smith(cos_o, alpha);
    return D_ggx(N, H, alpha) * shadowing * cos_o;
}
