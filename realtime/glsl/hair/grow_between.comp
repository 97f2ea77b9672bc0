#version 430
// Control points of hairs in the world, from the guides around each.
#include "hair/guides.glsl"
#include "hair/strands.glsl"
layout(local_size_x = 64) in;
uniform int count;
uniform int first;   // index of the first of these among all hairs
uniform int system;  // which hair of the scene they are of
uniform vec3 origin;
void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) return;
    vec4 color_radius = hairs[i].color_radius;
    for (int k = 0; k < 4; ++k)
        strand_points[4 * (first + i) + k] = vec4(origin + point_between(uint(i), k), color_radius.w);
    strand_colors[first + i] = vec4(color_radius.rgb, system);
}
