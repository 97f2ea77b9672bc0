#version 430
// The far pass, blurred at its own size.
#include "defocus_talk/blur.glsl"
uniform float far_slope;
layout(location = 0) out vec4 blurred;
void main() {
    float f = texelFetch(depth, ivec2(gl_FragCoord.xy), 0).r;
    vec2 outer = far_blur(f, far_slope);
    vec4 sum = taps(gl_FragCoord.xy, 0, INNER);
    sum += outer.x * taps(gl_FragCoord.xy, INNER, MIDDLE) + outer.y * taps(gl_FragCoord.xy, MIDDLE, TAPS);
    blurred = vec4(sum.rgb / sum.w, 1.0);
}
