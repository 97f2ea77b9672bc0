#version 430
// What the front side emits, and the light of lamps that its layers reflect; only the plane of the surface hides a lamp.
#include "layered/material.glsl"
#include "lib/beam.glsl"
#include "lib/light_spread.glsl"
layout(std430, binding = 3) readonly buffer Lights { Light lights[]; };
uniform int light_count;
uniform float spread;
uniform sampler2D emission_map;
uniform vec3 emission;
uniform vec3 eye;
in vec3 position;
in vec3 normal;
in vec2 uv;
layout(location = 0) out vec4 radiance;
void main() {
    vec3 seen = vec3(0.0), n = normalize(normal), V = normalize(eye - position);
    if (gl_FrontFacing) {
        seen = emission * textureLod(emission_map, uv, 0.0).rgb;
        for (int i = 0; i < light_count; ++i) {
            Beam beam = beam_of(lights[i], position);
            float wide = spread * light_spread(lights[i], position);
            seen += beam.irradiance * layered_reflection(uv, n, V, -beam.travel, wide * wide);
        }
    }
    radiance = vec4(seen, 1.0);
}
