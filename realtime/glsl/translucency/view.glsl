// A view of the subject whose faces are listed, from a light or along the grid, and the length inside it that lies behind a point.
#include "lib/centred_distance.glsl"
#include "lib/signed_length.glsl"
layout(binding = 1, r32ui) readonly uniform uimage2D view_counts;
layout(std430, binding = 2) readonly buffer ViewFaces { vec4 view_faces[]; };
uniform mat4 view_to_clip;
uniform vec3 view_offset;
uniform vec3 view_axis;
uniform bool view_is_parallel;

// x: length inside the subject between where the view is from and a point, which is seen from the subject's centre; y: above 0
// inside it. Faces are planes within a texel.
vec2 length_before(vec3 v) {
    vec4 clip = view_to_clip * vec4(v, 1.0);
    ivec2 size = imageSize(view_counts);
    vec2 place = (0.5 + 0.5 * clip.xy / clip.w) * vec2(size);
    ivec2 at = clamp(ivec2(place), ivec2(0), size - 1);
    vec2 off_middle = place - (vec2(at) + 0.5);
    float end = view_is_parallel ? dot(v, view_axis) : centred_distance(v, view_offset);
    int first = (at.y * size.x + at.x) * SLOTS, count = int(imageLoad(view_counts, at).r);
    vec2 sum = vec2(0.0);
    for (int i = 0; i < count; ++i) {
        vec4 face = view_faces[first + i];
        sum += signed_length(face.x + dot(face.zw, off_middle), face.y, end);
    }
    return sum;
}
