// What a fragment shader of a user gets, as docs/your-technique.md explains: world space, in the scene's unit of length.
#include "lib/lambert.glsl"
in vec3 position;
in vec3 normal;  // of the shading; interpolated, so not of length 1
in vec2 uv;
uniform vec3 eye;
uniform vec3 forward;  // where the camera looks, of length 1
uniform float is_subject;  // 1 on the subject, 0 on what surrounds it
uniform vec3 subject_low, subject_high;  // corners of the box around the subject
uniform vec3 scene_low, scene_high;  // and around everything
uniform vec3 emission;
uniform sampler2D reflectance_map;
uniform sampler2D emission_map;
layout(location = 0) out vec4 color;

// Diffuse reflectance, decoded to linear.
vec3 albedo() {
    return textureLod(reflectance_map, uv, 0.0).rgb;
}

// Radiance that the surface itself emits, on its front side.
vec3 emitted() {
    return emission * textureLod(emission_map, uv, 0.0).rgb;
}
