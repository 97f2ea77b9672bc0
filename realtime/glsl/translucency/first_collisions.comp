#version 430
// What light of the bound source is scattered for the first time in each cell, per unit of volume: the mean over those of SUBCELLS^3
// points that are inside the subject, for the part of the cell that is.
#include "translucency/lit.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Cells { vec4 cells[]; };  // first collisions, part inside
uniform vec3 corner;
uniform vec3 cell_size;
uniform vec3 sigma_s;
void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= CELLS * CELLS * CELLS) return;
    vec3 low = corner + cell_size * vec3(index % CELLS, index / CELLS % CELLS, index / (CELLS * CELLS));
    vec4 sum = vec4(0.0);
    for (int i = 0; i < SUBCELLS * SUBCELLS * SUBCELLS; ++i) {
        vec3 part = vec3(i % SUBCELLS, i / SUBCELLS % SUBCELLS, i / (SUBCELLS * SUBCELLS)) + 0.5;
        vec3 v = low + cell_size * part / float(SUBCELLS);
        vec2 before = length_before(v);
        if (before.y > 0.5) sum += vec4(unscattered_fluence(v, before.x), 1.0);
    }
    vec4 cell = cells[index];
    cells[index] = vec4(cell.rgb + sigma_s * cell.a * sum.rgb / max(sum.a, 1.0), cell.a);
}
