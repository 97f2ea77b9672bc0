#version 430
// Segments of hairs as ribbons that face the sensor, two triangles each, wide enough to reach all samples that they cover a part of,
// and as much longer at both ends. Fragments then find where the near side of the round hair is.
#include "hair/samples.glsl"
#include "hair/strands.glsl"
#ifdef SHADED
layout(std430, binding = 3) readonly buffer Radiance { vec4 hair_radiance[]; };
layout(std430, binding = 4) readonly buffer Order { uvec2 order[]; };
#endif
uniform mat4 world_to_clip;
uniform vec3 eye;
uniform vec2 half_size;  // of the target, in samples
noperspective out float away;       // from the hair's axis, in samples, as are all but the last three
noperspective out float width;
noperspective out float from_root;
noperspective out float to_tip;
noperspective out float shift;      // towards the tip, of the near side of the hair against its axis
out float rise;                     // of the near side above the ribbon, along the depth in clip space
out vec3 radiance;
flat out vec2 depth_of;             // depth in the buffer is x + y / w

// Which end of a segment a vertex is of, and on which side: 0-1-2 and 2-1-3 of a quad.
const ivec2 CORNERS[6] = ivec2[6](ivec2(0, -1), ivec2(0, 1), ivec2(1, -1), ivec2(1, -1), ivec2(0, 1), ivec2(1, 1));

// The least sine between a hair and the view at which a ribbon is a fair picture of it; steeper ones are short anyhow.
const float STEEPEST = 0.05;

// How far a step in the world goes across the target from where `place` is, in samples.
vec2 on_target(vec3 way, vec4 place) {
    vec4 moved = world_to_clip * vec4(way, 0.0);
    return half_size * (moved.xy - moved.w * place.xy / place.w) / place.w;
}

const float FAR = 1e4;

// How far it is along a hair on the target from one of its points, whose `place` is given, to an end, in samples; what lies behind the
// sensor is FAR. The way is cut short once the end is so far that no sample at the point reaches it: `enough`.
float way_to(int end, int from, vec4 place, float enough) {
    int onward = end < from ? -1 : 1;
    float way = 0.0;
    for (int a = from; a != end && way < enough; a += onward) {
        vec4 next = world_to_clip * vec4(samples[a + onward].position_radius.xyz, 1.0);
        if (next.w <= 0.0) return FAR;
        way += length(half_size * (next.xy / next.w - place.xy / place.w));
        place = next;
    }
    return way;
}

void main() {
    int segment = gl_VertexID / 6;
#ifdef SHADED
    segment = int(order[segment].y);
#endif
    ivec2 corner = CORNERS[gl_VertexID % 6];
    int strand = segment / SEGMENTS, first = strand * (SEGMENTS + 1), last = first + SEGMENTS;
    int at = segment + strand + corner.x;
    float radius = samples[at].position_radius.w;
    vec3 p = samples[at].position_radius.xyz, tangent = samples[at].tangent.xyz, v = normalize(p - eye);
    gl_Position = world_to_clip * vec4(p, 1.0);
    away = width = from_root = to_tip = shift = rise = 0.0;
    radiance = vec3(0.0);
    // Both rows of the matrix are the view's axis but for factors: z is linear in w.
    vec4 z = vec4(world_to_clip[0][2], world_to_clip[1][2], world_to_clip[2][2], world_to_clip[3][2]);
    vec4 w = vec4(world_to_clip[0][3], world_to_clip[1][3], world_to_clip[2][3], world_to_clip[3][3]);
    float slope = dot(z.xyz, w.xyz) / dot(w.xyz, w.xyz);
    depth_of = 0.5 * vec2(1.0 + slope, z.w - slope * w.w);
    if (gl_Position.w <= 0.0) return;  // behind the sensor
    vec3 side = cross(tangent, v);
    float sine = max(length(side), STEEPEST);
    // A hair that points straight at the sensor has no side; its ribbon may lie anyhow.
    if (dot(side, side) < 1e-12) side = cross(vec3(v.z, v.x, -v.y), v);
    side = normalize(side);
    vec2 along = on_target(tangent, gl_Position), reach = on_target(radius * side, gl_Position);
    vec2 across = vec2(-along.y, along.x);
    across = normalize(dot(across, reach) == 0.0 ? reach : across);
    width = 2.0 * abs(dot(across, reach));
    away = float(corner.y) * 0.5 * (width + 1.0);
    float stretch = max(length(along), 1e-6);
    shift = dot(on_target(radius * cross(tangent, side), gl_Position), along) / stretch;
    rise = radius / sine * gl_Position.w / distance(p, eye);
    float more = abs(shift) + 0.5;
    from_root = way_to(first, at, gl_Position, 2.0 * more);
    to_tip = way_to(last, at, gl_Position, 2.0 * more);
    if (at == first || at == last) {
        float outward = at == first ? -1.0 : 1.0;
        from_root += outward * more;
        to_tip -= outward * more;
        gl_Position = world_to_clip * vec4(p + outward * min(more / stretch, radius / STEEPEST) * tangent, 1.0);
    }
#ifdef SHADED
    radiance = strand_colors[strand].rgb * hair_radiance[at].rgb;
#endif
    gl_Position.xy += gl_Position.w * away * across / half_size;
}
