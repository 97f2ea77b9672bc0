#version 430
// Direct light on what a cube map sees: outgoing radiance of each texel from all lights, with shadows.
#include "lib/shadow.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D albedo_map;
layout(binding = 3) uniform sampler2D shadow_atlas;
layout(binding = 0, rgba32f) writeonly uniform image2D radiance;
layout(std430, binding = 0) readonly buffer Lights { Light lights[]; };
uniform int light_count;
uniform float scene_radius;

// Half a texel of slack for the map's resolution, one and a half along the normal for its slope.
const float NORMAL_OFFSET_TEXELS = 1.5;
const float SLACK_TEXELS = 0.5;

float visibility(int index, vec3 position, vec3 normal) {
    Light light = lights[index];
    float side = float(textureSize(shadow_atlas, 0).x) / 6.0;
    float texel = shadow_coordinates(light, position, side, scene_radius).w;
    vec4 c = shadow_coordinates(light, position + NORMAL_OFFSET_TEXELS * texel * normal, side, scene_radius);
    ivec2 at = ivec2(clamp(c.xy, vec2(0.0), vec2(6.0 * side, side) - 1.0)) + ivec2(0, index * int(side));
    return c.z <= texelFetch(shadow_atlas, at, 0).r + SLACK_TEXELS * texel ? 1.0 : 0.0;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(radiance)))) return;
    vec4 position = texelFetch(position_map, pixel, 0);
    vec3 sum = vec3(0.0);
    if (position.w > 0.0) {
        vec3 normal = texelFetch(normal_map, pixel, 0).xyz;
        for (int i = 0; i < light_count; ++i) {
            vec3 irradiance = unshadowed_irradiance(lights[i], position.xyz, normal);
            if (any(greaterThan(irradiance, vec3(0.0)))) sum += irradiance * visibility(i, position.xyz, normal);
        }
        sum *= texelFetch(albedo_map, pixel, 0).rgb / PI;
    }
    imageStore(radiance, pixel, vec4(sum, position.w));
}
