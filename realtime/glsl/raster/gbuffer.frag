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
    vec3 n = normalize(normal);
    vec3 albedo = textureLod(reflectance_map, uv, 0.0).rgb;
#ifdef AS_SEEN
    // Seen from behind, a surface is as black as its material says it is, and faces whoever sees it.
    if (!gl_FrontFacing) {
        n = -n;
        albedo = vec3(0.0);
    }
#endif
    out_position = vec4(position, 1.0);
    out_normal = vec4(n, is_subject);
    out_albedo = vec4(albedo, dot(position - eye, forward));
}
