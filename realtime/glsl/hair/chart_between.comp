#version 430
// For the root at each pixel of a chart: where the hair between guides ends, relative to the origin of the surface, or the tangent there.
#include "hair/guides.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) writeonly uniform image2D chart;
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(chart);
    if (any(greaterThanEqual(at, size))) return;
    uint i = uint(at.y * size.x + at.x);
#ifdef TANGENT
    imageStore(chart, at, vec4(tangent_between(i), 1.0));
#else
    imageStore(chart, at, vec4(point_between(i, 3), 1.0));
#endif
}
