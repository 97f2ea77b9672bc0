#version 430
// Sums turned into what the cells' textures hold, per unit of volume, and the rows that transport reads.
#include "hair_light/grid.glsl"
#include "hair_light/sums.glsl"
#include "hair_light/rows.glsl"
layout(std430, binding = 1) readonly buffer Systems { int cell_hair[]; };
layout(std430, binding = 2) readonly buffer Tangents { vec4 tangents[TANGENTS]; };
layout(binding = 0, rgba32f) writeonly uniform image3D across;
layout(binding = 1, rgba32f) writeonly uniform image3D between;
layout(local_size_x = 64) in;
uniform float hair_scale;
uniform float skin_scale;
uniform float radius;

vec3 summed(int first) {
    return vec3(sums[first], sums[first + 1], sums[first + 2]);
}

void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= CELLS * CELLS * CELLS) return;
    int first = SUMS * index;
    vec3 size = cell_size();
    float volume = size.x * size.y * size.z, scale = 1.0 / (hair_scale * volume);
    float area = float(sums[first + AREA]) * scale;
    ivec3 cell = cell_of(index);
    imageStore(across, cell, vec4(area, summed(first + MOMENT) * scale));
    imageStore(between, cell, vec4(summed(first + MOMENT + 3) * scale, 0.0));
    vec3 T = summed(first + TANGENT), normal = summed(first + SKIN_NORMAL) / skin_scale;
    int nearest = 0;
    for (int i = 1; i < TANGENTS; ++i)
        if (dot(T, tangents[i].xyz) > dot(T, tangents[nearest].xyz)) nearest = i;
    float skin = length(normal);
    vec3 reflected = summed(first + SKIN_REFLECTED) / skin_scale;
    // A hair neither lights nor hides itself: of n in a cell, n - 1 are others to each. One that crosses the cell has a diameter times its way.
    vec3 steps = abs(T) / size;
    float way = length(T) / max(max(steps.x, max(steps.y, steps.z)), 1e-30);
    float others = max(1.0 - 2.0 * radius * way / max(area * volume, 1e-30), 0.0);
    rows[index].hair = vec4(area, float(nearest), float(max(cell_hair[index] - 1, 0)), others);
    rows[index].tangent = vec4(any(notEqual(T, vec3(0.0))) ? normalize(T) : vec3(0.0, 1.0, 0.0), 0.0);
    rows[index].skin = vec4(skin > 0.0 ? normal / skin : vec3(0.0), skin);
    rows[index].reflectance = vec4(skin > 0.0 ? reflected / skin : vec3(0.0), 0.0);
}
