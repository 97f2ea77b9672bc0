// Irradiance from all lights with their shadows. Binds the lights to storage buffer 3, their distance maps to texture unit 3.
#include "lib/shadow.glsl"
layout(binding = 3) uniform sampler2D shadow_atlas;
layout(std430, binding = 3) readonly buffer Lights { Light lights[]; };
uniform int light_count;
uniform float scene_radius;
uniform int shadow_side;

// Half a texel of slack for the map's resolution, one and a half along the normal for its slope.
const float NORMAL_OFFSET_TEXELS = 1.5;
const float SLACK_TEXELS = 0.5;

float light_visibility(int index, vec3 position, vec3 normal) {
    Light light = lights[index];
    float side = float(shadow_side);
    int rows = textureSize(shadow_atlas, 0).y / shadow_side;
    ivec2 corner = ivec2(6 * (index / rows), index % rows) * shadow_side;
    float texel = shadow_coordinates(light, position, side, scene_radius).w;
    vec4 c = shadow_coordinates(light, position + NORMAL_OFFSET_TEXELS * texel * normal, side, scene_radius);
    ivec2 at = ivec2(clamp(c.xy, vec2(0.0), vec2(6.0 * side, side) - 1.0)) + corner;
    return c.z <= texelFetch(shadow_atlas, at, 0).r + SLACK_TEXELS * texel ? 1.0 : 0.0;
}

vec3 direct_irradiance(vec3 position, vec3 normal) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        vec3 irradiance = unshadowed_irradiance(lights[i], position, normal);
        if (any(greaterThan(irradiance, vec3(0.0)))) sum += irradiance * light_visibility(i, position, normal);
    }
    return sum;
}
