#version 430
// Radiance towards the camera: what the front side emits, and the direct light that it reflects.
#ifdef LIT
#include "indirect/direct_light.glsl"
#endif
uniform sampler2D reflectance_map;
uniform sampler2D emission_map;
uniform vec3 emission;
in vec3 position;
in vec3 normal;
in vec2 uv;
layout(location = 0) out vec4 radiance;
void main() {
    vec3 seen = vec3(0.0);
    if (gl_FrontFacing) {
        seen = emission * textureLod(emission_map, uv, 0.0).rgb;
#ifdef LIT
        seen += textureLod(reflectance_map, uv, 0.0).rgb / PI * direct_irradiance(position, normalize(normal));
#endif
    }
    radiance = vec4(seen, 1.0);
}
