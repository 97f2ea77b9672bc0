#version 430
// Irradiance coefficients at the cube's centre: one invocation for each of the nine.
#include "lib/sh.glsl"
#include "lib/surfels.glsl"
layout(local_size_x = 9) in;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Reflected { vec4 reflected[]; };
layout(std430, binding = 2) writeonly buffer Coefficients { vec4 coefficients[]; };
uniform int surroundings;
uniform vec3 centre;

void main() {
    int k = int(gl_LocalInvocationID.x);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < surroundings; ++i) {
        Surfel s = surfels[i];
        if (s.position_area.w == 0.0) continue;
        vec3 d = normalize(s.position_area.xyz - centre);
        sum += reflected[i].rgb * s.normal_solid_angle.w * sh_basis(d)[k];
    }
    coefficients[k] = vec4(sum * sh_cosine_factor(k), 0.0);
}
