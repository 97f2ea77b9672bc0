#version 430
// Direct light on the relief that each sample sees, which shades itself.
#include "displacement/quadtree.glsl"
#include "lib/light_place.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 3) uniform sampler2D position;
layout(binding = 4) uniform sampler2D normal;
layout(binding = 5) uniform sampler2D albedo;
layout(binding = 0, rgba32f) writeonly uniform image2D shaded;
layout(std430, binding = 3) readonly buffer Lights { Light lights[]; };
uniform int light_count;
uniform mat4 world_to_grid;
uniform float shadow_bias;

#ifdef SELF_SHADOW
// Whether the way from a place to a light is free. It begins on the surface as rounding leaves it, raised by the bias.
bool sees(vec3 place, Light light) {
    vec4 to = light_place(light);
    vec3 from = (world_to_grid * vec4(place, 1.0)).xyz;
    vec3 d = mat3(world_to_grid) * (to.xyz - to.w * place);
    from.z = height_at(from.xy) + shadow_bias;
    int entered;
    vec2 span = field_span(from, d, entered);
    span = vec2(max(span.x, 0.0), to.w == 1.0 ? min(span.y, 1.0) : span.y);
    vec3 hit;
    ivec2 cell;
    return span.x > span.y || !field_hit(from, d, span, hit, cell);
}
#endif

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(shaded)))) return;
    vec4 place = texelFetch(position, at, 0);
    vec3 n = texelFetch(normal, at, 0).xyz, sum = vec3(0.0);
    if (place.w > 0.0)
        for (int i = 0; i < light_count; ++i) {
            vec3 irradiance = unshadowed_irradiance(lights[i], place.xyz, n);
#ifdef SELF_SHADOW
            if (any(greaterThan(irradiance, vec3(0.0))) && !sees(place.xyz, lights[i])) continue;
#endif
            sum += irradiance;
        }
    imageStore(shaded, at, vec4(texelFetch(albedo, at, 0).rgb / PI * sum, place.w));
}
