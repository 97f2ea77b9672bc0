#version 430
// Radiance towards the camera: what the front side emits, and the direct light that it reflects. A front side shows its
// face and its shading normal; where the normals of a coarse mesh turn away before its faces do, it is black.
#ifdef LIT
#include "indirect/direct_light.glsl"
#endif
uniform sampler2D reflectance_map;
uniform sampler2D emission_map;
uniform vec3 emission;
uniform vec3 eye;
centroid in vec3 position;
centroid in vec3 normal;
centroid in vec2 uv;
#ifdef MULTISAMPLED
// Mesa's llvmpipe 22.3 interpolates at the centroid, but divides by w as it is at the pixel's centre: this 1 is as wrong.
centroid in float one;
#else
const float one = 1.0;
#endif
layout(location = 0) out vec4 radiance;
void main() {
    vec3 seen = vec3(0.0);
    vec3 n = normalize(normal), place = position / one;
    vec2 st = uv / one;
    if (gl_FrontFacing && dot(n, eye - place) > 0.0) {
        seen = emission * textureLod(emission_map, st, 0.0).rgb;
#ifdef LIT
        seen += textureLod(reflectance_map, st, 0.0).rgb / PI * direct_irradiance(place, n);
#endif
    }
    radiance = vec4(seen, 1.0);
}
