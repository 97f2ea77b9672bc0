#version 430
// Guides from texture space to the world: bases are morphed and skinned like positions, and used as matrices.
#include "hair/skinning.glsl"
layout(local_size_x = 64) in;
struct Stored {
    vec4 rest_weight;  // position of the root, w: weight of the upper bone
    vec4 morph;        // what the morph target adds to it
    vec4 basis[3];     // columns, at rest
    vec4 basis_morph[3];
    vec4 points[4];    // in texture space
};
struct Guide {
    vec4 points[4];
    vec4 basis[3];
};
layout(std430, binding = 0) readonly buffer StoredGuides { Stored stored[]; };
layout(std430, binding = 1) writeonly buffer Guides { Guide guides[]; };
uniform int count;
void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) return;
    mat4 bone = blended_bone(stored[i].rest_weight.w);
    vec3 root = (bone * vec4(stored[i].rest_weight.xyz + amount * stored[i].morph.xyz, 1.0)).xyz;
    mat3 basis;
    for (int k = 0; k < 3; ++k)
        basis[k] = mat3(bone) * (stored[i].basis[k].xyz + amount * stored[i].basis_morph[k].xyz);
    for (int k = 0; k < 3; ++k) guides[i].basis[k] = vec4(basis[k], 0.0);
    for (int k = 0; k < 4; ++k) guides[i].points[k] = vec4(root + basis * stored[i].points[k].xyz, 0.0);
}
