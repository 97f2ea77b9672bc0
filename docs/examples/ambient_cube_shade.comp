#version 430
// McTaggart 2004, "Half-Life 2 / Valve Source Shading", slide "Ambient cube": the three sides that a normal faces, weighted by
// its squared components.
#include "lib/lambert.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D albedo_map;
layout(binding = 0, rgba32f) writeonly uniform image2D shaded;
layout(std430, binding = 2) readonly buffer Sides { vec4 sides[6]; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(shaded)))) return;
    vec4 normal = texelFetch(normal_map, pixel, 0);
    vec3 irradiance = vec3(0.0);
    for (int axis = 0; axis < 3; ++axis)
        irradiance += normal[axis] * normal[axis] * sides[normal[axis] < 0.0 ? axis + 3 : axis].rgb;
    imageStore(shaded, pixel, vec4(texelFetch(albedo_map, pixel, 0).rgb / PI * irradiance, normal.w));
}
