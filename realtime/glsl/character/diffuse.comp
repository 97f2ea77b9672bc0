#version 430
// The sky, emitters and Lambertian surfaces; all else is black as yet.
#include "indirect/direct_light.glsl"
#include "character/seen.glsl"
layout(binding = 5) uniform sampler2D emitted_map;
layout(binding = 6) uniform sampler2D whole_map;
uniform vec3 background;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(shaded)))) return;
    vec4 position = texelFetch(position_map, at, 0), around = texelFetch(around_map, at, 0);
    vec3 n = texelFetch(normal_map, at, 0).xyz, seen = vec3(0.0);
    bool plain = is_kind(at, PLAIN);
    vec3 albedo = plain ? texelFetch(whole_map, at, 0).rgb : texelFetch(albedo_map, at, 0).rgb;
    if (position.w == 0.0) seen = background;
    else if (is_kind(at, EMITTER)) seen = texelFetch(emitted_map, at, 0).rgb;
    else if ((plain || is_kind(at, DIFFUSE)) && dot(n, eye - position.xyz) > 0.0)
        seen = albedo * (around.rgb + direct_irradiance(position.xyz, n) / PI);
    imageStore(shaded, at, vec4(seen, 1.0));
}
