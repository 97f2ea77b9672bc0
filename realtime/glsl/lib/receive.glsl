#include "lib/lambert.glsl"
#include "lib/surfels.glsl"

// Part of what a Lambertian receiver gets that a surfel accounts for when nothing stands between: the form factor.
float surfel_factor(Surfel s, vec3 position, vec3 normal) {
    if (s.position_area.w == 0.0) return max(dot(normal, s.position_area.xyz), 0.0) * s.normal_solid_angle.w / PI;
    return disk_form_factor(normal, s.position_area.xyz - position, s.normal_solid_angle.xyz, s.position_area.w);
}

// In a closed room the factors of a point sum to 1 (the closure of radiosity): dividing by the sum that the surfels reach
// removes what their size costs. In the open, factors may sum to less; more is never right.
float closure_scale(float sum, float closed) {
    return mix(max(sum, 1.0), max(sum, 1e-6), closed);
}
