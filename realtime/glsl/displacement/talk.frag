#version 430
// The talk's march through a volume of distances.
#include "displacement/polygon.glsl"
#include "lib/relief_march.glsl"
layout(binding = 2) uniform sampler3D distances;
uniform vec2 decode;  // factor and summand that make a distance of what is stored
uniform vec3 metric;
uniform vec3 first_texel;  // where texture space begins and ends in the volume
uniform vec3 last_texel;
float distance_at(vec3 at) {
    return decode.x * textureLod(distances, mix(first_texel, last_texel, at), 0.0).r + decode.y;
}

void main() {
    vec3 at = texCoord, t = tanEyeVec / extent;
    bool is_wall = face != TOP && distance_at(at) <= 0.0;
    if (!is_wall)
        for (int i = 0; i < NUM_ITERATIONS; ++i) at += march_step(distance_at(at), t, metric);
#ifdef DISCARD_OUTSIDE
    if (at.xy != clamp(at.xy, 0.0, 1.0)) discard;
#endif
    show(at.xy, is_wall);
}
