#version 430
// The talk's second pass with its shading: thickness, dependent lookup, areas of influence, combination.
#include "lib/talk_translucency.glsl"
layout(binding = 0) uniform sampler2D back_position;
layout(binding = 1) uniform sampler2D translucent_color;
layout(std430, binding = 0) readonly buffer Lights { vec4 lights[]; };  // place (w = 0: travels along -place), colour
uniform int light_count;
uniform vec3 eye;
uniform vec3 albedo;
uniform float longest;
uniform float power;
in vec3 position;
in vec3 normal;
layout(location = 0) out vec4 shaded;
void main() {
    vec4 back = texelFetch(back_position, ivec2(gl_FragCoord.xy), 0);
    float thickness = back.w == 0.0 ? 0.0 : normalised_thickness(position, back.xyz, longest);
    vec3 translucent = texture(translucent_color, vec2(thickness, 0.5)).rgb;
    vec3 V = normalize(eye - position), N = normalize(normal);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        vec4 place = lights[2 * i];
        vec3 L = normalize(position * place.w - place.xyz);
        vec3 plain = albedo / 3.14159265358979 * max(dot(N, -L), 0.0);
        sum += lights[2 * i + 1].rgb * mix(plain, translucent, area_of_influence(V, L, power));
    }
    shaded = vec4(sum, 1.0);
}
