#version 430
// Surfaces of one layered material. Light from all around is taken as even: what reaches the eye is the layers' albedo there.
#include "indirect/direct_light.glsl"
#include "lib/beam.glsl"
#include "character/seen.glsl"
#include "layered/material.glsl"
layout(binding = 5) uniform sampler2D uv_map;
layout(binding = 6) uniform sampler2D albedo_by_cosine;
uniform float kind;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(shaded))) || !is_kind(at, kind)) return;
    vec3 position = texelFetch(position_map, at, 0).xyz, n = texelFetch(normal_map, at, 0).xyz;
    vec3 V = normalize(eye - position), seen = vec3(0.0);
    vec2 uv = texelFetch(uv_map, at, 0).xy;
    if (dot(n, V) > 0.0) {
        seen = textureLod(albedo_by_cosine, vec2(dot(n, V), 0.5), 0.0).rgb * texelFetch(around_map, at, 0).rgb;
        for (int i = 0; i < light_count; ++i) {
            Beam beam = beam_of(lights[i], position);
            vec3 reflected = beam.irradiance * layered_reflection(uv, n, V, -beam.travel, 0.0);
            if (any(greaterThan(reflected, vec3(0.0)))) seen += reflected * light_visibility(i, position, n);
        }
    }
    imageStore(shaded, at, vec4(seen, 1.0));
}
