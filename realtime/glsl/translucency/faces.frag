#version 430
// Every face that a sample's ray meets, in any order: how far it is, +1 for a back and -1 for a front face, and how the distance
// changes from one sample to the next.
#include "lib/centred_distance.glsl"
#include "translucency/face.glsl"
layout(binding = 0, r32ui) uniform uimage2D face_counts;
layout(std430, binding = 1) writeonly buffer Faces { vec4 faces[]; };
uniform vec3 offset;
uniform vec3 axis;
uniform bool is_parallel;
uniform float steepest;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 v = place_on_face();
    float place = is_parallel ? dot(v, axis) : centred_distance(v, offset);
    vec2 slope = clamp(vec2(dFdx(place), dFdy(place)), -steepest, steepest);
    uint slot = imageAtomicAdd(face_counts, at, 1u);
    if (slot >= uint(SLOTS)) return;
    faces[(at.y * imageSize(face_counts).x + at.x) * SLOTS + int(slot)] = vec4(place, gl_FrontFacing ? -1.0 : 1.0, slope);
}
