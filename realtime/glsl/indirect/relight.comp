#version 430
// Direct light on what a cube map sees: outgoing radiance of each texel.
#include "indirect/direct_light.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D albedo_map;
layout(binding = 0, rgba32f) writeonly uniform image2D radiance;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(radiance)))) return;
    vec4 position = texelFetch(position_map, pixel, 0);
    vec3 lit = vec3(0.0);
    if (position.w > 0.0)
        lit = texelFetch(albedo_map, pixel, 0).rgb / PI * direct_irradiance(position.xyz, texelFetch(normal_map, pixel, 0).xyz);
    imageStore(radiance, pixel, vec4(lit, position.w));
}
