#version 430
// Control points of hairs in the world from their roots on the deformed surface.
#include "hair/roots.glsl"
#include "hair/strands.glsl"
layout(local_size_x = 64) in;
uniform int count;
uniform int first;    // index of the first of these among all hairs
uniform vec3 origin;  // of the surface
uniform int system;  // which hair of the scene they are of
void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) return;
    vec3 place;
    mat3 frame;
    stand_on_surface(uint(i), place, frame);
    float radius = roots[i].color_radius.w;
    place += origin;
    int at = first + i;
    strand_points[4 * at] = vec4(place, radius);
    for (int k = 0; k < 3; ++k) strand_points[4 * at + k + 1] = vec4(place + frame * roots[i].shape[k].xyz, radius);
    strand_colors[at] = vec4(roots[i].color_radius.rgb, system);
}
