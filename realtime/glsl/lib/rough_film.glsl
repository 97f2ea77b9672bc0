#include "lib/film.glsl"
#include "lib/ggx.glsl"

// What a rough clear film of index `ior` mirrors by itself; see ggx_reflection.
float film_reflection(vec3 N, vec3 V, vec3 L, vec3 H, float alpha, float ior) {
    return F_dielectric(clamp(dot(V, H), 0.0, 1.0), ior) * ggx_reflection(N, V, L, H, alpha);
}
