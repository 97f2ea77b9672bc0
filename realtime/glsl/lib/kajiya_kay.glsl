// Kajiya & Kay 1989, "Rendering Fur with Three Dimensional Textures", eqs. 14 and 16: a thin cylinder's diffuse light (x) and its
// highlight (y). T is the hair's tangent, L and V point to the light and to the eye. The highlight's cosine is that of the angle
// between V and the cone into which a smooth cylinder reflects; rounding may leave it a little above 1.
vec2 kajiya_kay(vec3 T, vec3 L, vec3 V, float exponent) {
    float tl = dot(T, L), tv = dot(T, V);
    float sin_l = sqrt(max(1.0 - tl * tl, 0.0)), sin_v = sqrt(max(1.0 - tv * tv, 0.0));
    float cosine = sin_l * sin_v - tl * tv;
    return vec2(sin_l, cosine > 0.0 ? pow(min(cosine, 1.0), exponent) : 0.0);
}
