#version 430
// For the root at each pixel of a chart: where its hair ends, relative to the origin of the surface, or the tangent of its frame.
#include "hair/roots.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) writeonly uniform image2D chart;
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(chart);
    if (any(greaterThanEqual(at, size))) return;
    uint i = uint(at.y * size.x + at.x);
    vec3 place;
    mat3 frame;
    stand_on_surface(i, place, frame);
#ifdef TANGENT
    imageStore(chart, at, vec4(frame[0], 1.0));
#else
    imageStore(chart, at, vec4(place + frame * roots[i].shape[2].xyz, 1.0));
#endif
}
