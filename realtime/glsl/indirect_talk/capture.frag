#version 430
// The talk's simplified "radiance" shader: N.L of two lights and the base colour, darkened with the distance from the cube.
uniform sampler2D reflectance_map;
uniform vec4 light_places[2];  // w = 1: a position; w = 0: the direction to the light
uniform vec3 light_colors[2];
uniform vec3 eye;
uniform float farthest;
uniform float far_brightness;
in vec3 position;
in vec3 normal;
in vec2 uv;
layout(location = 0) out vec4 color;
void main() {
    vec3 n = normalize(normal);
    vec3 diffuse = vec3(0.0);
    for (int i = 0; i < 2; ++i) {
        vec3 l = normalize(light_places[i].xyz - position * light_places[i].w);
        diffuse += max(dot(n, l), 0.0) * light_colors[i];
    }
    float brightness = mix(1.0, far_brightness, clamp(distance(position, eye) / farthest, 0.0, 1.0));
    color = vec4(texture(reflectance_map, uv, 1.0).rgb * diffuse * brightness, 1.0);
}
