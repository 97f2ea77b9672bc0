#version 430
// The matrix by which the surfels light each other. A workgroup works out what one surfel receives; it writes that as a
// column, so that neighbouring receivers read neighbouring words when they bounce.
#include "indirect/row.glsl"
layout(std430, binding = 1) writeonly buffer Transport { float transport[]; };

void main() {
    int index = int(gl_WorkGroupID.x);
    Surfel own = surfels[index];
    Row row = make_row(own.position_area.xyz, own.normal_solid_angle.xyz, index < surroundings ? -1 : index - surroundings);
    bool is_sky = own.position_area.w == 0.0;
    for (int i = int(gl_LocalInvocationID.x); i < surfel_count; i += 64)
        transport[i * surfel_count + index] = is_sky ? 0.0 : row_weight(row, i);
}
