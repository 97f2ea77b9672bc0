#version 430
// What each sample sees of a relief, as raster/gbuffer.frag writes it of a mesh, where nothing is seen before it. With FIRST
// there is nothing yet, not even black. With MARKED whoever looks marks what is the relief's.
#include "displacement/quadtree.glsl"
#include "displacement/view.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) uniform image2D position;
layout(binding = 1, rgba32f) writeonly uniform image2D normal;
layout(binding = 2, rgba32f) uniform image2D albedo;
uniform sampler2D reflectance_map;
uniform mat4 grid_to_world;
uniform mat3 world_to_grid;
uniform vec3 eye;
uniform vec3 forward;
uniform float is_subject;
#ifdef MARKED
#include "character/relief_marks.glsl"
#endif

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(position)))) return;
    vec3 o, d, place, n;
    view_ray(at, imageSize(position), o, d);
    bool is_hit = relief_hit(o, d, -1.0, place, n);
#ifdef FIRST
    if (!is_hit) {
        imageStore(position, at, vec4(0.0));
        imageStore(normal, at, vec4(0.0));
        imageStore(albedo, at, vec4(0.0));
    }
#endif
    if (!is_hit) return;
    vec4 seen = grid_to_world * vec4(place, 1.0);
    float depth = dot(seen.xyz - eye, forward);
#ifndef FIRST
    if (imageLoad(position, at).w > 0.0 && imageLoad(albedo, at).w <= depth) return;
#endif
    imageStore(position, at, seen);
    imageStore(normal, at, vec4(normalize(n * world_to_grid), is_subject));
    imageStore(albedo, at, vec4(textureLod(reflectance_map, place.xy / vec2(cells), 0.0).rgb, depth));
#ifdef MARKED
    mark_relief(at, place, n);
#endif
}
