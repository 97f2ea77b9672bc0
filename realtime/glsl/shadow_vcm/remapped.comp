#version 430
// NVIDIA 2005, "GeForce 7800 GTX demos", shader for receiving hard omnidirectional shadows. The remap cube tells where in the
// virtual cube map the depth in a direction lies.
#include "shadow_vcm/receive.glsl"
layout(binding = 2) uniform samplerCube remap;
layout(binding = 3) uniform sampler2DShadow virtual_cube_map;
uniform vec2 Q;         // the talk's cLightQ
uniform float zbias;
uniform float squeeze;  // MA over that of the vector that is looked up: more than 1 keeps it within the outermost texel centres

const vec2 TAPS[4] = vec2[](vec2(-0.4, 1.0), vec2(-1.0, -0.4), vec2(0.4, -1.0), vec2(1.0, 0.4));

vec2 unpacked(vec4 packed_uv) {
#ifdef LITERAL
    return packed_uv.xz + packed_uv.yw;
#else
    return packed_uv.xz + packed_uv.yw / 8.0;
#endif
}

float compared(vec2 uv, float depth) { return textureLod(virtual_cube_map, vec3(uv, depth), 0.0); }

float light_seen(vec3 normal, vec3 to_light) {
    vec3 size = abs(to_light);
    float MA = max(max(size.x, size.y), size.z);
    vec3 looked_up = to_light * mix(vec3(1.0), vec3(squeeze), greaterThanEqual(size, vec3(MA)));
    vec2 uv = unpacked(textureLod(remap, looked_up, 0.0));
    // King, Newhall 2004, "Efficient Omnidirectional Shadow Maps". Fixed-point formats clamp the depth; floats do not.
    float depth = min(0.5 * (Q.y + Q.x / MA) + 0.5 - zbias, 1.0);
#ifdef ROTATED_TAPS
    float sum = 0.0;
    for (int i = 0; i < 4; ++i) sum += compared(uv + TAPS[i] / (side * vec2(3.0, 2.0)), depth);
    return 0.25 * sum;
#else
    return compared(uv, depth);
#endif
}
