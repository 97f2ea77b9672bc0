// What a fragment of the polygons is given, and how it is lit.
#include "lib/lights.glsl"
layout(binding = 1) uniform sampler2D heights;
in vec3 texCoord;
in vec3 tanEyeVec;
in vec3 position;
flat in int face;
uniform vec3 extent;  // of texture space in lengths of the block
const int TOP = 5;

// Texture coordinates at which a filtered lookup has its samples at the ends of 0 to 1.
vec2 between_samples(vec2 uv, vec2 size) {
    return (uv * (size - 1.0) + 0.5) / size;
}

#ifdef UV
layout(location = 0) out vec4 color;
void show(vec2 uv, bool is_wall) {
    color = vec4(clamp(uv, 0.0, 1.0) * vec2(textureSize(heights, 0) - 1), 0.0, 1.0);
}
#else
uniform sampler2D reflectance_map;
layout(binding = 3) uniform sampler2D normal_map;
layout(std430, binding = 3) readonly buffer Lights { Light lights[]; };
uniform int light_count;
uniform mat3 world_to_tangent;
layout(location = 0) out vec4 color;

// "Simple lighting": nothing shades anything. The light is where it is for the polygon.
void show(vec2 uv, bool is_wall) {
    vec2 inside = clamp(uv, 0.0, 1.0);
    vec3 normal = textureLod(normal_map, between_samples(inside, vec2(textureSize(normal_map, 0))), 0.0).xyz;
    if (is_wall) {
        normal = vec3(0.0);
        normal[face >> 1] = float(2 * (face & 1) - 1);
    }
    vec3 world_normal = normalize(normal) * world_to_tangent, sum = vec3(0.0);
    for (int i = 0; i < light_count; ++i) sum += unshadowed_irradiance(lights[i], position, world_normal);
    color = vec4(textureLod(reflectance_map, inside, 0.0).rgb / PI * sum, 1.0);
}
#endif
