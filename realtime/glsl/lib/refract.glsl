// The direction of a ray beyond a surface: Snell's law in the form of NVIDIA's talk on the GeForce 7800 GTX demos (2005).
// `in_ray` points at the surface, `in_normal` against it; both have length 1. `in_u` is the index before the surface over the
// one behind it: 1 / n on the way in. With n instead of it, cosTheta is the root of a negative number beyond the critical angle.
vec3 refract_talk(vec3 in_ray, vec3 in_normal, float in_u) {
    float cosPhi = dot(-in_ray, in_normal);
    float cosTheta = sqrt(1.0 - in_u * in_u * (1.0 - cosPhi * cosPhi));
    vec3 result = in_u * in_ray + (in_u * cosPhi - cosTheta) * in_normal;
    return normalize(result);
}

// The same where the ray may not get through: total reflection is told by false, and `refracted` is then the grazing ray.
bool refract_through(vec3 in_ray, vec3 in_normal, float in_u, out vec3 refracted) {
    float cos_i = -dot(in_ray, in_normal);
    float cos2_t = 1.0 - in_u * in_u * (1.0 - cos_i * cos_i);
    refracted = normalize(in_u * in_ray + (in_u * cos_i - sqrt(max(cos2_t, 0.0))) * in_normal);
    return cos2_t > 0.0;
}
