#version 430
// Which octaves of blur the samples of a layer fall into, one bit each.
#include "defocus_layers/octave.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D radiance;
layout(binding = 1) uniform sampler2D coc;
layout(std430, binding = 0) buffer Found { uint found; };
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, textureSize(coc, 0))) || texelFetch(radiance, at, 0).a == 0.0) return;
    uint bit = 1u << octave_of(abs(texelFetch(coc, at, 0).r));
    if ((found & bit) == 0u) atomicOr(found, bit);
}
