#version 430
// The talk's second pass: front faces fetch the back position at their own place on the screen.
#include "lib/talk_translucency.glsl"
layout(binding = 0) uniform sampler2D back_position;
uniform float longest;
in vec3 position;
layout(location = 0) out float thickness;
void main() {
    vec4 back = texelFetch(back_position, ivec2(gl_FragCoord.xy), 0);
    thickness = back.w == 0.0 ? 0.0 : longest * normalised_thickness(position, back.xyz, longest);
}
