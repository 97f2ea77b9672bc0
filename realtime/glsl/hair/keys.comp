#version 430
// How far each segment is from the sensor, as a key that sorts the farthest first.
#include "hair/samples.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 4) writeonly buffer Order { uvec2 order[]; };
uniform vec3 eye;
uniform int count;   // of segments
uniform int padded;  // to a power of two
void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= padded) return;
    uint key = 0xffffffffu;
    if (i < count) {
        int at = i + i / SEGMENTS;
        vec3 middle = 0.5 * (samples[at].position_radius.xyz + samples[at + 1].position_radius.xyz);
        key = ~floatBitsToUint(distance(middle, eye));  // the bits of positive floats are in the order of their values
    }
    order[i] = uvec2(key, i);
}
