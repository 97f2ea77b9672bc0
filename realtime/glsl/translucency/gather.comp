#version 430
// What is scattered towards the camera along a sample's ray inside the subject, as far as it gets out: with SINGLE light that was
// not scattered before, from the bound source; else light that was, from the grid.
#include "lib/step_characteristic.glsl"
#include "translucency/lit.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) uniform image2D shaded;
layout(binding = 2, r32ui) readonly uniform uimage2D face_counts;
layout(std430, binding = 1) readonly buffer Faces { vec4 faces[]; };
layout(binding = 0) uniform sampler3D fluence;
#ifdef CUT
// What is opaque ends a ray; what lies beyond the subject is seen through it.
layout(binding = 4) uniform sampler2D position_map;
layout(binding = 3, rgba32f) writeonly uniform image2D passed;
uniform vec3 eye;
#endif
uniform vec3 offset;
uniform vec3 forward;
uniform vec3 right;
uniform vec3 up;
uniform vec3 corner;
uniform vec3 cell_size;
uniform vec3 sigma_s;

const float PATH_A_STEP = 0.25;  // mean free paths, of the densest channel; .3 % of what is scattered once
const int MOST_STEPS = 64;      // a segment; what lies deeper than 16 mean free paths is not seen

vec3 fluence_at(vec3 v) {
#if SINGLE
    return unscattered_fluence(v, length_before(v).x);
#else
    return textureLod(fluence, (v - corner) / (cell_size * float(CELLS)), 0.0).rgb;
#endif
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(shaded);
    if (any(greaterThanEqual(at, size))) return;
    int count = int(imageLoad(face_counts, at).r), first = (at.y * size.x + at.x) * SLOTS;
    if (count == 0) return;
    vec2 met[SLOTS];
    for (int i = 0; i < count; ++i) {
        vec2 face = faces[first + i].xy;
        int k = i;
        for (; k > 0 && met[k - 1].x > face.x; --k) met[k] = met[k - 1];
        met[k] = face;
    }
    vec2 ndc = (vec2(at) + 0.5) / vec2(size) * 2.0 - 1.0;
    vec3 direction = normalize(forward + ndc.x * right + ndc.y * up);
    float densest = max(sigma_t.r, max(sigma_t.g, sigma_t.b)), bodies = 0.0, centre_distance = length(offset);
    vec3 kept = vec3(1.0), sum = vec3(0.0);
#ifdef CUT
    vec4 opaque = texelFetch(position_map, at, 0);
    float end = opaque.w > 0.0 ? distance(opaque.xyz, eye) - centre_distance : 3e38;
#endif
    for (int i = 0; i + 1 < count; ++i) {
        bodies -= met[i].y;
        float start = met[i].x, path = met[i + 1].x - start;
        if (bodies < 0.5) continue;
#ifdef CUT
        path = min(path, end - start);
        if (path <= 0.0) break;
#endif
        int steps = clamp(int(ceil(path * densest / PATH_A_STEP)), 1, MOST_STEPS);
        float stride = min(path / float(steps), PATH_A_STEP / densest);
        for (int s = 0; s < steps; ++s) {
            vec3 v = (centre_distance + start + (float(s) + 0.5) * stride) * direction - offset;
            Crossing crossing = step_characteristic(vec3(0.0), sigma_s * fluence_at(v) / (4.0 * PI), sigma_t, stride);
            sum += kept * crossing.leaving;
            kept *= exp(-sigma_t * stride);
        }
        kept *= exp(-sigma_t * max(path - float(steps) * stride, 0.0));
    }
    imageStore(shaded, at, imageLoad(shaded, at) + vec4(sum, 0.0));
#ifdef CUT
    imageStore(passed, at, vec4(kept, 1.0));
#endif
}
