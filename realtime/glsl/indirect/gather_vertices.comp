#version 430
// What each vertex of a subject that is not convex receives, a workgroup a vertex. The sky's own light is direct light and
// left out.
#include "indirect/row.glsl"
struct Receiver {
    vec4 position;
    vec4 normal;
};
layout(std430, binding = 1) readonly buffer Reflected { vec4 reflected[]; };
layout(std430, binding = 2) readonly buffer Receivers { Receiver receivers[]; };
layout(std430, binding = 4) writeonly buffer Received { vec4 received[]; };
uniform int first;

void main() {
    int index = first + int(gl_WorkGroupID.x);
    Row row = make_row(receivers[index].position.xyz, receivers[index].normal.xyz, index);
    vec3 sum = vec3(0.0);
    for (int i = int(gl_LocalInvocationID.x); i < surfel_count; i += 64)
        if (surfels[i].position_area.w > 0.0) sum += row_weight(row, i) * reflected[i].rgb;
    sum = reduced(sum);
    if (gl_LocalInvocationID.x == 0u) received[index - first] = vec4(sum, 1.0);
}
