#version 430
// The talk's first pass: where the back faces are, in world space; w tells that there is one.
in vec3 position;
layout(location = 0) out vec4 back;
void main() {
    back = vec4(position, 1.0);
}
