// What the eye mirrors: the captured surroundings (texture unit 4), behind them the sky (texture unit 5).
#include "lib/cube.glsl"
#include "lib/sky.glsl"
layout(binding = 4) uniform sampler2D cube_radiance;
layout(binding = 5) uniform sampler2D sky;

// Radiance from a direction in the eye's frame.
vec3 sky_radiance(vec3 d) {
#ifdef SKY
    vec3 world = eye_to_world * d;
    return textureLod(sky, sky_uv(world, float(textureSize(sky, 0).y)), 0.0).rgb;
#else
    return vec3(0.0);
#endif
}

vec3 mirrored_radiance(vec3 d) {
#ifdef SURROUNDINGS
    vec2 st;
    int side = textureSize(cube_radiance, 0).y;
    int face = cube_face(eye_to_world * d, st);
    ivec2 texel = min(ivec2((0.5 * st + 0.5) * float(side)), side - 1) + ivec2(face * side, 0);
    vec4 seen = texelFetch(cube_radiance, texel, 0);
    if (seen.w > 0.0) return seen.rgb;
#endif
    return sky_radiance(d);
}
