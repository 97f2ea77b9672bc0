// A grid of CELLS^3 boxes around all hair. Its corners are found on the GPU, as floats that are ordered like unsigned integers.
layout(std430, binding = 4) buffer Bounds { uint bounds[6]; };  // lowest x, y, z, then the highest

uint ordered(float x) {
    uint bits = floatBitsToUint(x);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}

float from_ordered(uint bits) {
    return uintBitsToFloat((bits & 0x80000000u) != 0u ? bits & 0x7fffffffu : ~bits);
}

vec3 grid_corner() {
    return vec3(from_ordered(bounds[0]), from_ordered(bounds[1]), from_ordered(bounds[2]));
}

vec3 cell_size() {
    vec3 high = vec3(from_ordered(bounds[3]), from_ordered(bounds[4]), from_ordered(bounds[5]));
    return (high - grid_corner()) / float(CELLS);
}

ivec3 cell_at(vec3 position) {
    return clamp(ivec3((position - grid_corner()) / cell_size()), ivec3(0), ivec3(CELLS - 1));
}

int cell_index(ivec3 cell) {
    return (cell.z * CELLS + cell.y) * CELLS + cell.x;
}

ivec3 cell_of(int index) {
    return ivec3(index % CELLS, index / CELLS % CELLS, index / (CELLS * CELLS));
}
