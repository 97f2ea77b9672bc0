#version 430
// The character hides the light.
layout(location = 0) out vec4 color;
void main() { color = vec4(0.0); }
