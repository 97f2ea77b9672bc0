#version 430
// Irradiance on each side of a small cube at `centre`: one invocation a side.
#include "lib/surfels.glsl"
layout(local_size_x = 6) in;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Reflected { vec4 reflected[]; };
layout(std430, binding = 2) writeonly buffer Sides { vec4 sides[6]; };
uniform int surroundings;
uniform vec3 centre;

void main() {
    int side = int(gl_LocalInvocationID.x);
    vec3 normal = vec3(0.0);
    normal[side % 3] = side < 3 ? 1.0 : -1.0;
    vec3 irradiance = vec3(0.0);
    for (int i = 0; i < surroundings; ++i) {
        Surfel s = surfels[i];
        if (s.position_area.w == 0.0) continue;  // the sky, whose light is direct
        vec3 d = normalize(s.position_area.xyz - centre);
        irradiance += reflected[i].rgb * s.normal_solid_angle.w * max(dot(d, normal), 0.0);
    }
    sides[side] = vec4(irradiance, 0.0);
}
