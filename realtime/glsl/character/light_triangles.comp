#version 430
// The light of lamps that the front of each triangle reflects, over pi.
#include "indirect/direct_light.glsl"
#include "character/places.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Lit { vec4 lit[]; };
layout(std430, binding = 6) readonly buffer Reflectances { vec4 reflectances[]; };
uniform int triangle_count;

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= triangle_count) return;
    vec3 irradiance = direct_irradiance(places[i].position.xyz, places[i].normal.xyz);
    lit[i] = vec4(reflectances[i].rgb / PI * irradiance, 1.0);
}
