#version 430
// What each place receives, over pi.
#include "character/around.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Received { vec4 received[]; };

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= place_count) return;
    received[i] = vec4(mean_radiance(i), 1.0);
}
