// Whether a ray meets a disk on the side of its normal. All vectors but `centre` and `o` have length 1.
bool disk_hit(vec3 o, vec3 d, vec3 centre, vec3 normal, float radius) {
    float cosine = -dot(d, normal);
    if (cosine <= 1e-7) return false;  // edge on, but for what rounding leaves
    float t = dot(o - centre, normal) / cosine;
    vec3 v = o + t * d - centre;
    return t > 0.0 && dot(v, v) <= radius * radius;
}
