#version 430
// Positions after morph, then skin.
#include "hair/skinning.glsl"
layout(local_size_x = 64) in;
struct Vertex {
    vec4 rest_weight;  // w: weight of the upper bone
    vec4 morph;
};
layout(std430, binding = 0) readonly buffer Vertices { Vertex vertices[]; };
layout(std430, binding = 1) writeonly buffer Positions { vec4 positions[]; };
uniform int count;
void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) return;
    vec4 rest = vertices[i].rest_weight;
    vec4 morphed = vec4(rest.xyz + amount * vertices[i].morph.xyz, 1.0);
    positions[i] = blended_bone(rest.w) * morphed;
}
