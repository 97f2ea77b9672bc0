#version 430
// One more bounce between the surfels: reflected radiance = direct + albedo / pi * irradiance from what all reflected before.
// Goral, Torrance, Greenberg, Battaile 1984, "Modeling the Interaction of Light Between Diffuse Surfaces", eq. 6. What the
// cube sees of a room that is convex is seen by every surfel; where it is not, light leaks through what stands between.
#include "lib/lambert.glsl"
#include "lib/surfels.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Before { vec4 before[]; };
layout(std430, binding = 2) writeonly buffer After { vec4 after[]; };
uniform int surfel_count;
uniform float closed;

void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= surfel_count) return;
    Surfel own = surfels[index];
    if (own.position_area.w == 0.0) {
        after[index] = own.radiance;
        return;
    }
    vec3 received = vec3(0.0);
    float sum = 0.0;
    for (int i = 0; i < surfel_count; ++i) {
        Surfel s = surfels[i];
        float factor;
        if (s.position_area.w > 0.0)
            factor = disk_form_factor(own.normal_solid_angle.xyz, s.position_area.xyz - own.position_area.xyz,
                                      s.normal_solid_angle.xyz, s.position_area.w);
        else
            factor = max(dot(own.normal_solid_angle.xyz, s.position_area.xyz), 0.0) * s.normal_solid_angle.w / PI;
        received += before[i].rgb * factor;
        sum += factor;
    }
    // In a closed room the factors of a point sum to 1 (the closure of radiosity): dividing by the sum that the surfels
    // reach removes what their size costs. In the open, factors may sum to less; more is never right.
    float scale = mix(max(sum, 1.0), max(sum, 1e-6), closed);
    after[index] = vec4(own.radiance.rgb + own.albedo.rgb * received / scale, 1.0);
}
