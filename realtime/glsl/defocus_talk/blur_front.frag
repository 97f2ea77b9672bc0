#version 430
// The layer in front of the near pass, at its opacity: alpha is blurred, colour is the mean of what was drawn.
#include "defocus_talk/ramps.glsl"
#include "lib/vogel.glsl"
layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2D depth;
uniform float radius; // of the disk, in texels
uniform float far_slope;
layout(location = 0) out vec4 blurred;
void main() {
    vec2 outer = far_blur(1.0 - texelFetch(depth, ivec2(gl_FragCoord.xy), 0).r, far_slope);
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int i = 0; i < TAPS; ++i) {
        ivec2 at = ivec2(floor(gl_FragCoord.xy + radius * vogel_point(i, TAPS, 0.0)));
        vec4 seen = texelFetch(color, clamp(at, ivec2(0), textureSize(color, 0) - 1), 0);
        float weight = i < INNER ? 1.0 : i < MIDDLE ? outer.x : outer.y;
        sum += weight * vec4(seen.rgb * seen.a, seen.a);
        weights += weight;
    }
    blurred = sum.a > 0.0 ? vec4(sum.rgb / sum.a, sum.a / weights) : vec4(0.0);
}
