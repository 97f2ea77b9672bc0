#version 430
// The talk's final equation: diffuse = env_diffuse * (0.8 + 0.2 shadow_mult) + the sum of N.L * LightColor * shadow_mult.
// Indirect light is the character's, which casts a soft shadow on the rest; on itself, it is in shadow where it faces away.
uniform sampler2D reflectance_map;
uniform sampler2D emission_map;
uniform samplerCube blurred;
uniform vec4 light_places[2];  // w = 1: a position; w = 0: the direction to the light
uniform vec3 light_colors[2];
uniform bool casts[2];  // the character casts a soft shadow of this light, which is at `jetpack`
uniform vec3 jetpack;
uniform vec3 centre;
uniform float c;
uniform float scale;
uniform float is_subject;
uniform vec3 emission;
in vec3 position;
in vec3 normal;
in vec2 uv;
layout(location = 0) out vec4 radiance;
void main() {
    radiance = vec4(0.0, 0.0, 0.0, 1.0);
    if (!gl_FrontFacing) return;
    vec3 n = normalize(normal);
    float soft = 1.0;
    vec3 env_diffuse = vec3(0.0);
#ifdef CAPTURED
    if (is_subject == 0.0) soft = textureLod(blurred, position - jetpack, 0.0).a;
    else env_diffuse = scale * textureLod(blurred, n + c * (position - centre), 0.0).rgb;
#endif
    vec3 diffuse = vec3(0.0);
    float own = 1.0;
    for (int i = 0; i < 2; ++i) {
        float n_dot_l = dot(n, normalize(light_places[i].xyz - position * light_places[i].w));
        diffuse += max(n_dot_l, 0.0) * light_colors[i] * (casts[i] ? soft : 1.0);
        if (casts[i]) own = step(0.0, n_dot_l);
    }
    diffuse += env_diffuse * (0.8 + 0.2 * own);
    radiance.rgb = emission * textureLod(emission_map, uv, 0.0).rgb + textureLod(reflectance_map, uv, 0.0).rgb * diffuse;
}
