#version 430
// One more bounce between the surfels: reflected = direct + albedo * (transport matrix * what all reflected before).
// Goral, Torrance, Greenberg, Battaile 1984, "Modeling the Interaction of Light Between Diffuse Surfaces", eq. 6. What the
// cube sees of a room that is convex is seen by every surfel; where it is not, light leaks through what stands between.
#include "lib/surfels.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Transport { float transport[]; };
layout(std430, binding = 2) readonly buffer Before { vec4 before[]; };
layout(std430, binding = 3) writeonly buffer After { vec4 after[]; };
layout(std430, binding = 4) readonly buffer Lit { vec4 lit[]; };
uniform int surfel_count;

void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= surfel_count) return;
    vec3 received = vec3(0.0);
    for (int i = 0; i < surfel_count; ++i) received += transport[i * surfel_count + index] * before[i].rgb;
    after[index] = vec4(lit[index].rgb + surfels[index].albedo.rgb * received, 1.0);
}
