#version 430
// One of the talk's three blurs, cylindrical about `axis`: seven vectors rotated in steps, and the six between them. The talk
// rotates in the vertex shader; rotation is linear, so rotating here gives the same vectors.
#include "lib/cube.glsl"
uniform samplerCube source;
uniform vec3 axis;
uniform int face;
uniform float step_angle;
uniform float seam_bias;
uniform vec3 jitter[13];
in vec2 st;
layout(location = 0) out vec4 color;

vec3 rotated(vec3 v, float angle) {  // Rodrigues' formula
    return mix(axis * dot(axis, v), v, cos(angle)) + cross(axis, v) * sin(angle);
}

void main() {
    // The corners of the cube, normalised, so 1 / sqrt(3) across a face; pushed away from the face's normal to hide seams.
    vec3 base = mix(cube_direction(face, st) * inversesqrt(3.0), cube_direction(face, vec2(0.0)), seam_bias);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 13; ++i) {
        // Even: a vector of the vertex shader; odd: halfway between its neighbours.
        float low = float((i & ~1) / 2 - 3) * step_angle;
        vec3 v = (i & 1) == 0 ? rotated(base, low) : 0.5 * (rotated(base, low) + rotated(base, low + step_angle));
        sum += textureLod(source, v + jitter[i], 0.0);
    }
    color = sum / 13.0;
}
