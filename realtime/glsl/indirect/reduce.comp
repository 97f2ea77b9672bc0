#version 430
// Gather BLOCK x BLOCK texels of the captured cube into one surfel, weighted by their solid angles. A block that sees both
// surfaces and sky becomes a surface with the area that it really shows; the sky's share of it is lost.
#include "lib/cube.glsl"
#include "lib/surfels.glsl"
layout(local_size_x = 64) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D albedo_map;
layout(std430, binding = 0) writeonly buffer Surfels { Surfel surfels[]; };
uniform vec3 centre;
uniform int surfel_count;

// Texels seen more edge-on than this would claim an area that they do not show.
const float COS_MIN = 0.02;

void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= surfel_count) return;
    int side = textureSize(position_map, 0).y;
    int across = side / BLOCK;
    int face = index / (across * across);
    ivec2 corner = ivec2(index % across, (index / across) % across) * BLOCK;
    vec3 position = vec3(0.0), normal = vec3(0.0), albedo = vec3(0.0), direction = vec3(0.0);
    float area = 0.0, seen = 0.0, total = 0.0;
    for (int y = 0; y < BLOCK; ++y) for (int x = 0; x < BLOCK; ++x) {
        ivec2 texel = corner + ivec2(x, y);
        vec2 st = 2.0 * (vec2(texel) + 0.5) / float(side) - 1.0;
        float solid_angle = cube_texel_solid_angle(st, float(side));
        vec3 d = normalize(cube_direction(face, st));
        ivec2 at = texel + ivec2(face * side, 0);
        vec4 p = texelFetch(position_map, at, 0);
        total += solid_angle;
        direction += solid_angle * d;
        if (p.w > 0.0) {
            vec3 n = texelFetch(normal_map, at, 0).xyz;
            vec3 v = p.xyz - centre;
            float a = solid_angle * dot(v, v) / max(-dot(n, d), COS_MIN);
            position += a * p.xyz;
            normal += a * n;
            area += a;
            albedo += solid_angle * texelFetch(albedo_map, at, 0).rgb;
            seen += solid_angle;
        }
    }
    Surfel s;
    if (area > 0.0) {
        s.position_area = vec4(position / area, area);
        s.normal_solid_angle = vec4(normalize(normal + vec3(0.0, 1e-30, 0.0)), seen);
        s.albedo = vec4(albedo / seen, 1.0);
    } else {
        s.position_area = vec4(normalize(direction), 0.0);
        s.normal_solid_angle = vec4(0.0, 0.0, 0.0, total);
        s.albedo = vec4(0.0);
    }
    surfels[index] = s;
}
