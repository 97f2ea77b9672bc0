// NVIDIA 2005, the GeForce 7800 GTX demos: the far intersection with a sphere about the origin. `rayd` has length 1. NaN if
// the ray misses. Its discriminant subtracts squares of the distance: good near the sphere, wrong from far away.
float SphereIntersect(float sphere_radius_squared, vec3 rayo, vec3 rayd) {
    vec3 v = vec3(0.0, 0.0, 0.0) - rayo;
    float b = dot(v, rayd);
    float disc = (b * b) - dot(v, v) + sphere_radius_squared;
    disc = sqrt(disc);
    float t2 = b + disc;
    return t2;
}

// Haines, Guenther, Akenine-Moeller 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, ch. 7: the
// distance from the ray to the centre is taken before it is squared, and the smaller root comes from the product of both.
// `o` is relative to the centre, `d` has length 1; x is where the ray enters, y where it leaves. False if it misses.
bool sphere_roots(float radius, vec3 o, vec3 d, out vec2 t) {
    float b = -dot(o, d);
    vec3 l = o + b * d;
    float disc = radius * radius - dot(l, l);
    t = vec2(0.0);
    if (disc < 0.0) return false;
    float q = b + (b < 0.0 ? -1.0 : 1.0) * sqrt(disc);
    float other = q == 0.0 ? 0.0 : (dot(o, o) - radius * radius) / q;
    t = vec2(min(q, other), max(q, other));
    return true;
}
