#version 430
uniform mat4 world_to_clip;
in vec3 in_position;
in vec3 in_normal;
in vec2 in_uv;
out vec3 position;
out vec3 normal;
out vec2 uv;
out float one;
invariant gl_Position;  // so that a later pass may draw what is exactly as deep as an earlier one left it
void main() {
    position = in_position;
    normal = in_normal;
    uv = in_uv;
    one = in_position.x > -3e38 ? 1.0 : 0.0;  // a constant would not be interpolated
    gl_Position = world_to_clip * vec4(in_position, 1.0);
}
