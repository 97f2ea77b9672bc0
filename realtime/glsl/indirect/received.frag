#version 430
uniform sampler2D reflectance_map;
uniform float is_subject;
in vec3 received;
in vec2 uv;
layout(location = 0) out vec4 color;
void main() {
    color = vec4(is_subject * textureLod(reflectance_map, uv, 0.0).rgb * received, is_subject);
}
