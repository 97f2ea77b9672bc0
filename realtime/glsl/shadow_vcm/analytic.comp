#version 430
// The virtual cube map of the talk without its remap cube: the tile and the place in it follow from the way to the light. Each
// of the four texels around that place is compared with the depth that the receiver's own plane has there, after Isidoro
// 2006, "Shadow Mapping: GPU-based Tips and Techniques", receiver plane depth bias; here exact, since depths are linear.
#include "shadow_vcm/receive.glsl"
layout(binding = 2) uniform sampler2D virtual_cube_map;
uniform float margin;  // b: texels of a tile beyond 90 degrees, on each side
uniform float far;
uniform float rounding;

// The four texels reach one texel beyond the place. So far may a surface that meets the receiver's in a crease rise above the
// receiver's plane without standing in the light.
const float SLACK_TEXELS = 1.0;

float light_seen(vec3 normal, vec3 to_light) {
    vec3 size = abs(to_light);
    int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    // Components along the axis, the columns and the rows of the tile.
    vec3 d = vec3(to_light[axis], to_light[(axis + 1) % 3], to_light[(axis + 2) % 3]);
    vec3 n = vec3(normal[axis], normal[(axis + 1) % 3], normal[(axis + 2) % 3]);
    float MA = abs(d.x);
    float half_width = 0.5 * side - margin;
    vec2 middle = side * vec2(float(axis) + 0.5, d.x < 0.0 ? 1.5 : 0.5);
    vec2 place = middle + half_width * d.yz / MA;

    vec2 first = floor(place - 0.5) + 0.5;
    vec2 weight = place - first;
    vec4 stored = textureGather(virtual_cube_map, (first + 0.5) / (side * vec2(3.0, 2.0)));
    float light_height = dot(n, d) - SLACK_TEXELS * MA / half_width;
    const vec2 GATHERED[4] = vec2[](vec2(0, 1), vec2(1, 1), vec2(1, 0), vec2(0, 0));
    vec4 seen;
    for (int i = 0; i < 4; ++i) {
        // The way to the light through the texel's centre, of length 1 along the axis, climbs by this much. One that does not
        // climb never meets the plane.
        float climb = dot(n, vec3(sign(d.x), (first + GATHERED[i] - middle) / half_width));
        float depth = light_height / max(climb, 1e-20) / far - rounding;
        seen[i] = min(depth, 1.0) <= stored[i] ? 1.0 : 0.0;
    }
    vec2 rows = mix(seen.wx, seen.zy, weight.x);
    return mix(rows.x, rows.y, weight.y);
}
