#version 430
// Direct light on the subject's surfels.
#include "indirect/direct_light.glsl"
#include "lib/surfels.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) writeonly buffer Lit { vec4 lit[]; };
uniform int surroundings;
uniform int surfel_count;

void main() {
    int index = surroundings + int(gl_GlobalInvocationID.x);
    if (index >= surfel_count) return;
    Surfel s = surfels[index];
    lit[index] = vec4(s.albedo.rgb / PI * direct_irradiance(s.position_area.xyz, s.normal_solid_angle.xyz), 1.0);
}
