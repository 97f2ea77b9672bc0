#version 430
// Fluence from all directions, and one step of Chebyshev's semi-iteration (Golub & Varga 1961, "Chebyshev Semi-Iterative Methods",
// eq. 2.11), which needs about the square root of the number of plain source iterations.
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Along { vec4 along[]; };
layout(std430, binding = 1) readonly buffer Fluence { vec4 fluence[]; };
layout(std430, binding = 2) buffer Before { vec4 before[]; };  // becomes the next fluence
uniform int direction_count;
uniform vec3 damping;
uniform vec3 omega;
void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= CELLS * CELLS * CELLS) return;
    vec3 scattered = vec3(0.0);
    for (int i = 0; i < direction_count; ++i) scattered += along[i * CELLS * CELLS * CELLS + index].rgb;
    vec3 now = fluence[index].rgb, last = before[index].rgb;
    before[index] = vec4(last + omega * (damping * (scattered - now) + now - last), 0.0);
}
