#version 430
// What each vertex of a subject that is not convex receives. The sky's own light is direct light and left out.
#include "indirect/self_receive.glsl"
layout(local_size_x = 64) in;
struct Receiver {
    vec4 position;
    vec4 normal;
};
layout(std430, binding = 2) readonly buffer Receivers { Receiver receivers[]; };
layout(std430, binding = 4) writeonly buffer Received { vec4 received[]; };
uniform int first;
uniform int receiver_count;

void main() {
    int index = first + int(gl_GlobalInvocationID.x);
    if (index >= receiver_count) return;
    Receiver r = receivers[index];
    received[index - first] = vec4(self_received(index, r.position.xyz, r.normal.xyz, false), 1.0);
}
