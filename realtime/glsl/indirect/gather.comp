#version 430
// Each sample of the subject adds up the surfels as surface elements seen from where it is itself, so a cube that was
// captured at one place serves every place: E = sum of L_i pi F_i, outgoing radiance = albedo / pi * E.
#include "lib/lambert.glsl"
#include "lib/surfels.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D albedo_map;
layout(binding = 0, rgba32f) writeonly uniform image2D shaded;
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Reflected { vec4 reflected[]; };
uniform int surfel_count;
uniform float closed;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(shaded)))) return;
    vec4 normal = texelFetch(normal_map, pixel, 0);
    if (normal.w == 0.0) {
        imageStore(shaded, pixel, vec4(0.0));
        return;
    }
    vec3 position = texelFetch(position_map, pixel, 0).xyz;
    vec3 received = vec3(0.0);
    float sum = 0.0;
    for (int i = 0; i < surfel_count; ++i) {
        Surfel s = surfels[i];
        if (s.position_area.w == 0.0) {
            sum += max(dot(normal.xyz, s.position_area.xyz), 0.0) * s.normal_solid_angle.w / PI;
            continue;
        }
        float factor = disk_form_factor(normal.xyz, s.position_area.xyz - position, s.normal_solid_angle.xyz, s.position_area.w);
        received += reflected[i].rgb * factor;
        sum += factor;
    }
    float scale = mix(max(sum, 1.0), max(sum, 1e-6), closed);
    imageStore(shaded, pixel, vec4(texelFetch(albedo_map, pixel, 0).rgb * received / scale, 1.0));
}
