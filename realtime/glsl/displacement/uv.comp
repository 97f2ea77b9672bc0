#version 430
// The place of a relief, in its samples, that each sample of the image sees.
#include "displacement/quadtree.glsl"
#include "displacement/view.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) writeonly uniform image2D uv;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(uv)))) return;
    vec3 o, d, place, normal;
    view_ray(at, imageSize(uv), o, d);
    bool is_hit = relief_hit(o, d, -1.0, place, normal);
    imageStore(uv, at, is_hit ? vec4(place.xy, 0.0, 1.0) : vec4(0.0));
}
