#version 430
// One more bounce between the surfels: reflected radiance = direct + albedo / pi * irradiance from what all reflected before.
// Goral, Torrance, Greenberg, Battaile 1984, "Modeling the Interaction of Light Between Diffuse Surfaces", eq. 6. What the
// cube sees of a room that is convex is seen by every surfel; where it is not, light leaks through what stands between.
#include "lib/receive.glsl"
#ifdef SELF
#include "indirect/self_receive.glsl"
#else
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Before { vec4 before[]; };
uniform int surfel_count;
uniform float closed;
#endif
layout(local_size_x = 64) in;
layout(std430, binding = 2) writeonly buffer After { vec4 after[]; };

vec3 received_by(Surfel own) {
    vec3 received = vec3(0.0);
    float sum = 0.0;
    for (int i = 0; i < surfel_count; ++i) {
        float factor = surfel_factor(surfels[i], own.position_area.xyz, own.normal_solid_angle.xyz);
        received += before[i].rgb * factor;
        sum += factor;
    }
    return received / closure_scale(sum, closed);
}

void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= surfel_count) return;
    Surfel own = surfels[index];
    if (own.position_area.w == 0.0) {
        after[index] = own.radiance;
        return;
    }
#ifdef SELF
    vec3 received = index < surroundings ? received_by(own)
        : self_received(index - surroundings, own.position_area.xyz, own.normal_solid_angle.xyz, true);
#else
    vec3 received = received_by(own);
#endif
    after[index] = vec4(own.radiance.rgb + own.albedo.rgb * received, 1.0);
}
