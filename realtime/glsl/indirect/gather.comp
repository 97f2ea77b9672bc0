#version 430
// Each sample of a convex subject adds up the surroundings as surface elements seen from where it is itself, so a cube that was
// captured at one place serves every place. The sky's own light is direct light and left out.
#include "lib/receive.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D albedo_map;
layout(binding = 0, rgba32f) writeonly uniform image2D shaded;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Reflected { vec4 reflected[]; };
uniform int surroundings;
uniform float closed;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(shaded)))) return;
    vec4 normal = texelFetch(normal_map, pixel, 0);
    if (normal.w == 0.0) {
        imageStore(shaded, pixel, vec4(0.0));
        return;
    }
    vec3 position = texelFetch(position_map, pixel, 0).xyz;
    vec3 received = vec3(0.0);
    float sum = 0.0;
    for (int i = 0; i < surroundings; ++i) {
        Surfel s = surfels[i];
        float factor = surfel_factor(s, position, normal.xyz);
        if (s.position_area.w > 0.0) received += reflected[i].rgb * factor;
        sum += factor;
    }
    vec3 albedo = texelFetch(albedo_map, pixel, 0).rgb;
    imageStore(shaded, pixel, vec4(albedo * received / closure_scale(sum, closed), 1.0));
}
