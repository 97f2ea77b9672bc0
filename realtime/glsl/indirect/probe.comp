#version 430
// Each sample of the subject looks its irradiance up by its normal alone, as if it were at the cube's centre.
#include "lib/lambert.glsl"
#include "lib/sh.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D albedo_map;
layout(binding = 0, rgba32f) writeonly uniform image2D shaded;
layout(std430, binding = 2) readonly buffer Coefficients { vec4 coefficients[]; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(shaded)))) return;
    vec4 normal = texelFetch(normal_map, pixel, 0);
    vec3 irradiance = vec3(0.0);
    if (normal.w > 0.0) {
        float[9] basis = sh_basis(normal.xyz);
        for (int k = 0; k < 9; ++k) irradiance += coefficients[k].rgb * basis[k];
    }
    vec3 radiance = texelFetch(albedo_map, pixel, 0).rgb / PI * max(irradiance, vec3(0.0));
    imageStore(shaded, pixel, vec4(radiance, normal.w));
}
