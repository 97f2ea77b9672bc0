#version 430
// What each receiver sees of the subject itself along directions as dense as the cosine: the index of the nearest of the
// subject's own surfels that face the same side as the triangle that is hit, or -1. Neighbouring invocations are neighbouring
// receivers, whose rays take nearly the same way through the hierarchy.
#include "lib/hemisphere.glsl"
#include "lib/surfels.glsl"
#include "indirect_grid/first_hit.glsl"
layout(local_size_x = 64) in;
struct Receiver {
    vec4 position;
    vec4 normal;
};
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Receivers { Receiver receivers[]; };
layout(std430, binding = 2) writeonly buffer Hits { int hits[]; };
uniform int surroundings;
uniform int surfel_count;
uniform int receiver_count;
uniform float offset;

int nearest_own(vec3 place, vec3 normal) {
    int nearest = 0;
    float least = 3e38;
    for (int i = surroundings; i < surfel_count; ++i) {
        vec3 v = surfels[i].position_area.xyz - place;
        float distance2 = dot(surfels[i].normal_solid_angle.xyz, normal) > 0.0 ? dot(v, v) : 3e38;
        if (distance2 < least) {
            least = distance2;
            nearest = i - surroundings;
        }
    }
    return nearest;
}

void main() {
    int receiver = int(gl_GlobalInvocationID.x), ray = int(gl_GlobalInvocationID.y);
    if (receiver >= receiver_count) return;
    vec3 normal = receivers[receiver].normal.xyz;
    vec3 origin = receivers[receiver].position.xyz + offset * normal, direction = cosine_direction(ray, normal);
    Hit hit = first_hit(origin, direction);
    int own = -1;
    if (hit.triangle >= 0) {
        vec3 outward = cross(triangles[3 * hit.triangle + 1].xyz, triangles[3 * hit.triangle + 2].xyz);
        own = nearest_own(origin + hit.distance * direction, outward);
    }
    hits[ray * receiver_count + receiver] = own;
}
