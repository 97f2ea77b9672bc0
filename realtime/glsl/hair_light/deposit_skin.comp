#version 430
// What hair grows on, into the cells: points that stand for equal parts of its surface.
#include "hair_light/grid.glsl"
#include "hair_light/sums.glsl"
struct Facet {
    vec4 place;
    vec4 normal_area;
    vec4 reflectance;
};
layout(std430, binding = 1) readonly buffer Facets { Facet facets[]; };
layout(local_size_x = 64) in;
uniform int count;
uniform float area_scale;
void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) return;
    vec3 cell = (facets[i].place.xyz - grid_corner()) / cell_size();
    if (any(lessThan(cell, vec3(0.0))) || any(greaterThanEqual(cell, vec3(CELLS)))) return;
    int first = SUMS * cell_index(ivec3(cell));
    vec4 facing = facets[i].normal_area;
    for (int c = 0; c < 3; ++c) {
        atomicAdd(sums[first + SKIN_NORMAL + c], int(round(area_scale * facing.w * facing[c])));
        atomicAdd(sums[first + SKIN_REFLECTED + c], int(round(area_scale * facing.w * facets[i].reflectance[c])));
    }
}
