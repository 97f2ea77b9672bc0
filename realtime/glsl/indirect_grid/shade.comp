#version 430
// Each sample of a convex subject sees the whole hemisphere about its normal: the harmonics there, weighted by the cosine.
// Ramamoorthi & Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps", eq. 7.
#include "indirect_grid/interpolate.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D albedo_map;
layout(binding = 0, rgba32f) writeonly uniform image2D shaded;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(shaded)))) return;
    vec4 normal = texelFetch(normal_map, pixel, 0);
    vec3 irradiance = vec3(0.0);
    if (normal.w > 0.0) {
        vec3[9] harmonics = harmonics_at(texelFetch(position_map, pixel, 0).xyz);
        float[9] basis = sh_basis(normal.xyz);
        for (int k = 0; k < 9; ++k) irradiance += sh_cosine_factor(k) * basis[k] * harmonics[k];
    }
    vec3 albedo = texelFetch(albedo_map, pixel, 0).rgb;
    imageStore(shaded, pixel, vec4(albedo / 3.14159265358979 * max(irradiance, 0.0), normal.w));
}
