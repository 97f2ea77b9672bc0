#version 430
// The part of each cell that is inside the subject, from a view along z: mean over SUBCELLS^2 columns.
#include "translucency/view.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Cells { vec4 cells[]; };  // first collisions, part inside
uniform vec3 corner;
uniform vec3 cell_size;
void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= CELLS * CELLS * CELLS) return;
    vec3 low = corner + cell_size * vec3(index % CELLS, index / CELLS % CELLS, index / (CELLS * CELLS));
    float inside = 0.0;
    for (int i = 0; i < SUBCELLS * SUBCELLS; ++i) {
        vec3 v = low + cell_size * vec3((vec2(i % SUBCELLS, i / SUBCELLS) + 0.5) / float(SUBCELLS), 0.0);
        inside += length_before(v + vec3(0.0, 0.0, cell_size.z)).x - length_before(v).x;
    }
    cells[index] = vec4(vec3(0.0), clamp(inside / (cell_size.z * float(SUBCELLS * SUBCELLS)), 0.0, 1.0));
}
