#version 430
// A mesh of the eye, handed on in the eye's own frame.
#include "eye/uniforms.glsl"
uniform mat4 world_to_clip;
uniform vec3 eye_position;
in vec3 in_position;
in vec3 in_normal;
out vec3 obj_coord;
out vec3 obj_normal;
void main() {
    obj_coord = (in_position - eye_position) * eye_to_world;
    obj_normal = in_normal * eye_to_world;
    gl_Position = world_to_clip * vec4(in_position, 1.0);
}
