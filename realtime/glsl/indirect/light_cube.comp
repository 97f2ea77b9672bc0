#version 430
// What the surfels of the captured cube send out of direct light, the mean over their texels by solid angle. Sky: what it emits;
// surfaces: what they reflect, no emission.
#include "lib/cube.glsl"
#include "lib/sky.glsl"
#include "lib/surfels.glsl"
layout(local_size_x = 64) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 3) uniform sampler2D radiance_map;
layout(binding = 4) uniform sampler2D sky_map;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) writeonly buffer Lit { vec4 lit[]; };
uniform int surroundings;

void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= surroundings) return;
    int side = textureSize(position_map, 0).y;
    int across = side / BLOCK;
    int face = index / (across * across);
    ivec2 corner = ivec2(index % across, (index / across) % across) * BLOCK;
    vec3 radiance = vec3(0.0), sky = vec3(0.0);
    float seen = 0.0, total = 0.0;
    for (int y = 0; y < BLOCK; ++y) for (int x = 0; x < BLOCK; ++x) {
        ivec2 texel = corner + ivec2(x, y);
        vec2 st = 2.0 * (vec2(texel) + 0.5) / float(side) - 1.0;
        float solid_angle = cube_texel_solid_angle(st, float(side));
        ivec2 at = texel + ivec2(face * side, 0);
        total += solid_angle;
        if (texelFetch(position_map, at, 0).w > 0.0) {
            radiance += solid_angle * texelFetch(radiance_map, at, 0).rgb;
            seen += solid_angle;
        } else {
            vec3 d = normalize(cube_direction(face, st));
            sky += solid_angle * textureLod(sky_map, sky_uv(d, float(textureSize(sky_map, 0).y)), 0.0).rgb;
        }
    }
    lit[index] = vec4(surfels[index].position_area.w > 0.0 ? radiance / seen : sky / total, 1.0);
}
