#version 430
// What each sample sees: w of position is 1 where something was hit, w of normal tells the subject, w of albedo the depth.
uniform sampler2D reflectance_map;
uniform vec3 eye;
uniform vec3 forward;
uniform float is_subject;
in vec3 position;
in vec3 normal;
in vec2 uv;
layout(location = 0) out vec4 out_position;
layout(location = 1) out vec4 out_normal;
layout(location = 2) out vec4 out_albedo;
void main() {
    out_position = vec4(position, 1.0);
    out_normal = vec4(normalize(normal), is_subject);
    out_albedo = vec4(textureLod(reflectance_map, uv, 0.0).rgb, dot(position - eye, forward));
}
