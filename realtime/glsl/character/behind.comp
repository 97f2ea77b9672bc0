#version 430
// A picture of the surroundings where they are seen from a planar depth on.
#include "character/seen.glsl"
layout(binding = 7) uniform sampler2D behind;
uniform vec3 forward;
uniform float behind_from;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(shaded);
    if (any(greaterThanEqual(at, size)) || texelFetch(normal_map, at, 0).w != 0.0) return;
    vec4 position = texelFetch(position_map, at, 0);
    if (position.w == 0.0 || dot(position.xyz - eye, forward) >= behind_from)
        imageStore(shaded, at, textureLod(behind, (vec2(at) + 0.5) / vec2(size), 0.0));
}
