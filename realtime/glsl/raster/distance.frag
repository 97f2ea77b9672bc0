#version 430
// Distance to the light, linear and unbiased: biases belong to whoever reads the map.
uniform vec3 eye;
uniform vec3 forward;
uniform bool parallel;
in vec3 position;
layout(location = 0) out float out_distance;
void main() {
    vec3 v = position - eye;
    out_distance = parallel ? dot(v, forward) : length(v);
}
