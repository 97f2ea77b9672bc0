#version 430
// The blurred far pass, filtered to the size of the near pass, as far away as a depth buffer goes.
layout(binding = 0) uniform sampler2D blurred;
in vec2 st;
layout(location = 0) out vec4 color;
void main() {
    color = textureLod(blurred, 0.5 * st + 0.5, 0.0);
    gl_FragDepth = 1.0;
}
