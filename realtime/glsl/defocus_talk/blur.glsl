// Taps on a disk, in order of their distance from its middle: the first are the inner sum, the others the outer sums.
#include "defocus_talk/ramps.glsl"
#include "lib/vogel.glsl"
layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2D depth;
uniform float radius; // of the disk, in texels

// Sums over the taps from `first` up to `last`; w counts them. Each tap is at a corner, where the hardware filters four texels.
vec4 taps(vec2 texel, int first, int last) {
    vec4 sum = vec4(0.0);
    vec2 size = vec2(textureSize(color, 0));
    for (int i = first; i < last; ++i) {
        vec2 corner = floor(texel + radius * vogel_point(i, TAPS, 0.0) + 0.5);
        sum += vec4(textureLod(color, corner / size, 0.0).rgb, 1.0);
    }
    return sum;
}
