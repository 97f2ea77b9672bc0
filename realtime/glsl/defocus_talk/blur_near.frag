#version 430
// The near pass; what has the depth of the background comes from the far pass, and is blurred already.
#include "defocus_talk/blur.glsl"
uniform float near_start;
layout(location = 0) out vec4 blurred;
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 sum = vec4(texelFetch(color, pixel, 0).rgb, 1.0);
    float f = texelFetch(depth, pixel, 0).r;
#if DEPTH_BITS < 24
    float steps = float((1 << DEPTH_BITS) - 1);
    f = round(f * steps) / steps;
#endif
    if (f < 1.0) sum += near_blur(f, near_start) * taps(gl_FragCoord.xy, 0, TAPS);
    blurred = vec4(sum.rgb / sum.w, 1.0);
}
