#version 430
// Thickness to radiance, sample by sample: what a slab of that thickness, which faces the camera, reflects and transmits.
#include "lib/beam.glsl"
#include "lib/centred_distance.glsl"
#include "lib/coverage_taps.glsl"
#include "lib/slab_table.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D thickness_map;
layout(binding = 1) uniform sampler2D position_map;
layout(binding = 2) uniform sampler2D normal_map;
layout(binding = 3) uniform sampler2D first_back;
layout(binding = 4) uniform sampler2D mask;
layout(binding = 5) uniform sampler2D transmitted;
layout(binding = 6) uniform sampler2D reflected;
layout(std430, binding = 0) readonly buffer Lights { Light lights[]; };
layout(binding = 0, rgba32f) writeonly uniform image2D shaded;
uniform int light_count;
uniform bool is_layered;
uniform vec3 eye;
uniform vec3 forward;
uniform vec3 centre;
uniform vec3 offset;
uniform vec3 sigma_t;
uniform float thinnest;
uniform float spread;
uniform float padding;
uniform float pixels_at_unit_depth;

vec3 table(sampler2D entries, float thickness, float cosine) {
    vec2 uv = slab_table_uv(thickness, cosine, thinnest, vec2(textureSize(entries, 0)));
    return slab_table_radiance(textureLod(entries, uv, 0.0).rgb, thickness, cosine, thinnest);
}

// Part of a Gaussian of standard deviation `sigma` samples around this one that the subject covers: what lies beyond its edge
// neither lights this place nor keeps light from leaving.
float coverage(ivec2 at, float sigma) {
    vec2 size = vec2(imageSize(shaded));
    vec2 here = (vec2(at) + 0.5 - 0.5 * size) / (padding * size) + 0.5;
    float lod = log2(max(sigma / (float(GRID) * sqrt(float(TAPS))), 1.0));
    float sum = 0.0;
    for (int i = 0; i < TAPS; ++i) sum += textureLod(mask, here + sigma * gaussian_tap(i, TAPS) / (padding * size), lod).r;
    return sum / float(TAPS);
}

// Light from behind through two layers: what leaves the far one is diffuse, and crosses the near one straight or scattered there;
// what crosses the far one straight is scattered in the near one.
vec3 transmission(float near, float far, float cosine) {
    vec3 through_near = table(transmitted, near, cosine);
    if (far <= 0.0) return through_near;
    vec3 leaves_far = table(transmitted, far, cosine);
    vec3 diffuse_through_near = PI * table(transmitted, near, DIFFUSE_COSINE) / DIFFUSE_COSINE + exp(-sigma_t * near);
    return leaves_far * diffuse_through_near + exp(-sigma_t * far / max(cosine, 1e-3)) * through_near;
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(shaded)))) return;
    float thickness = texelFetch(thickness_map, at, 0).r;
    vec4 hit = texelFetch(position_map, at, 0);
    vec3 sum = vec3(0.0);
    if (thickness > 0.0 && hit.w > 0.0) {
        vec3 position = hit.xyz, N = texelFetch(normal_map, at, 0).xyz, V = normalize(eye - position);
        float near = thickness;
        if (is_layered) {
            vec2 back = texelFetch(first_back, at, 0).xy;
            if (back.y > 0.0) near = clamp(back.x - centred_distance(position - centre, offset), 0.0, thickness);
        }
        float sigma = spread * thickness * pixels_at_unit_depth / dot(position - eye, forward);
        float kept = coverage(at, sigma);
        for (int i = 0; i < light_count; ++i) {
            Beam beam = beam_of(lights[i], position);
            float behind = dot(V, beam.travel), before = -dot(N, beam.travel);
            if (behind > 0.0) sum += kept * beam.irradiance * transmission(near, thickness - near, behind);
            else sum += beam.irradiance * table(reflected, near, max(before, 0.0));
        }
    }
    imageStore(shaded, at, vec4(sum, 1.0));
}
