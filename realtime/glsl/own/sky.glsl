// Light from infinitely far away.
#include "lib/sky.glsl"
layout(binding = 4) uniform sampler2D sky_map;

vec3 sky_radiance(vec3 direction) {
    return textureLod(sky_map, sky_uv(direction, float(textureSize(sky_map, 0).y)), 0.0).rgb;
}
