#version 430
// Direct light on the subject's surfels.
#include "indirect/direct_light.glsl"
#include "lib/surfels.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Surfels { Surfel surfels[]; };
uniform int first;
uniform int surfel_count;

void main() {
    int index = first + int(gl_GlobalInvocationID.x);
    if (index >= surfel_count) return;
    Surfel s = surfels[index];
    surfels[index].radiance = vec4(s.albedo.rgb / PI * direct_irradiance(s.position_area.xyz, s.normal_solid_angle.xyz), 1.0);
}
