#version 430
// The polygons that a displacement map is put on: the block's box, its top at the greatest height.
#include "displacement/box.glsl"
uniform mat4 box_to_world;
uniform mat4 world_to_clip;
uniform vec3 eye;
uniform mat3 world_to_tangent;
out vec3 texCoord;
out vec3 tanEyeVec;
out vec3 position;
flat out int face;
void main() {
    texCoord = box_corner(gl_VertexID, face);
    position = (box_to_world * vec4(texCoord, 1.0)).xyz;
    vec3 world_eye_vec = position - eye;
    tanEyeVec = world_to_tangent * world_eye_vec;
#ifdef NORMALISED
    tanEyeVec = normalize(tanEyeVec);
#endif
    gl_Position = world_to_clip * vec4(position, 1.0);
}
