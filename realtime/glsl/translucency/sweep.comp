#version 430
// Light that travels along one direction, carried through the grid plane by plane: a work group for each direction. What is
// scattered into it comes from the fluence of the iteration before (source iteration, Lewis & Miller 1984, "Computational Methods of
// Neutron Transport", section 4-4); inside a cell the source is constant (step characteristics, section 4-3).
#include "lib/step_characteristic.glsl"
layout(local_size_x = CELLS, local_size_y = CELLS) in;
layout(std430, binding = 0) readonly buffer Cells { vec4 cells[]; };
layout(std430, binding = 1) readonly buffer Fluence { vec4 fluence[]; };
layout(std430, binding = 2) writeonly buffer Along { vec4 along[]; };
layout(std430, binding = 3) readonly buffer Directions { vec4 directions[]; };  // unit vector, weight: part of 4 pi
uniform vec3 cell_size;
uniform vec3 sigma_s;
uniform vec3 sigma_t;
shared vec3 plane[CELLS * CELLS];

vec3 on_plane(ivec2 at) {
    return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, ivec2(CELLS))) ? plane[at.y * CELLS + at.x] : vec3(0.0);
}

void main() {
    ivec2 at = ivec2(gl_LocalInvocationID.xy);
    vec4 direction = directions[gl_WorkGroupID.x];
    vec3 cells_crossed = direction.xyz / cell_size, a = abs(cells_crossed);
    int k = a.x >= a.y && a.x >= a.z ? 0 : (a.y >= a.z ? 1 : 2), kx = (k + 1) % 3, ky = (k + 2) % 3;
    vec2 slope = vec2(cells_crossed[kx], cells_crossed[ky]) / a[k];
    ivec2 from = at - ivec2(ceil(slope));
    vec2 part = ceil(slope) - slope;
    plane[at.y * CELLS + at.x] = vec3(0.0);
    barrier();
    for (int i = 0; i < CELLS; ++i) {
        vec3 entering = mix(mix(on_plane(from), on_plane(from + ivec2(1, 0)), part.x),
                            mix(on_plane(from + ivec2(0, 1)), on_plane(from + ivec2(1, 1)), part.x), part.y);
        barrier();
        ivec3 cell;
        cell[k] = cells_crossed[k] > 0.0 ? i : CELLS - 1 - i;
        cell[kx] = at.x;
        cell[ky] = at.y;
        int index = (cell.z * CELLS + cell.y) * CELLS + cell.x;
        vec4 content = cells[index];
        vec3 emitted = (content.rgb + sigma_s * content.a * fluence[index].rgb) / (4.0 * 3.14159265358979);
        Crossing crossing = step_characteristic(entering, emitted, sigma_t * content.a, 1.0 / a[k]);
        plane[at.y * CELLS + at.x] = crossing.leaving;
        along[int(gl_WorkGroupID.x) * CELLS * CELLS * CELLS + index] =
            vec4(4.0 * 3.14159265358979 * direction.w * crossing.mean, 0.0);
        barrier();
    }
}
