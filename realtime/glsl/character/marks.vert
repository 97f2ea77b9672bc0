#version 430
uniform mat4 world_to_clip;
in vec3 in_position;
in vec2 in_uv;
in vec4 in_received;
out vec3 received;
out vec2 uv;
invariant gl_Position;  // as in raster/mesh.vert: both see the same surface
void main() {
    received = in_received.rgb;
    uv = in_uv;
    gl_Position = world_to_clip * vec4(in_position, 1.0);
}
