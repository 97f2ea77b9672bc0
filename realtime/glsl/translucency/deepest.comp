#version 430
// The most faces that any ray meets.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, r32ui) readonly uniform uimage2D face_counts;
layout(std430, binding = 0) buffer Deepest { uint deepest; };
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(face_counts)))) return;
    atomicMax(deepest, imageLoad(face_counts, at).r);
}
