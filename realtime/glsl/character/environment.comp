#version 430
// The radiance that arrives from each of some directions: the mean over places on a body, of those that face that way and from
// which the body itself is not met.
#include "character/places.glsl"
#include "indirect_grid/first_hit.glsl"
#include "lib/sky.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Directions { vec4 toward[]; };
layout(std430, binding = 1) readonly buffer Radiosity { vec4 radiosity[]; };
layout(std430, binding = 6) readonly buffer Reflectances { vec4 reflectances[]; };  // w: which shape
layout(std430, binding = 7) writeonly buffer Arriving { vec4 arriving[]; };
layout(binding = 5) uniform sampler2D sky;
uniform int direction_count;
uniform float offset;
uniform float own;

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= direction_count) return;
    vec3 d = toward[i].xyz;
    vec4 sum = vec4(0.0);
    for (int k = 0; k < place_count; ++k) {
        vec3 normal = places[k].normal.xyz;
        if (dot(normal, d) <= 0.0) continue;
        int met = first_hit(places[k].position.xyz + offset * normal, d).triangle;
        if (met < 0) sum += vec4(textureLod(sky, sky_uv(d, float(textureSize(sky, 0).y)), 0.0).rgb, 1.0);
        else if (reflectances[met].w != own) {
            vec3 outward = cross(triangles[3 * met + 1].xyz, triangles[3 * met + 2].xyz);
            sum += vec4(dot(outward, d) < 0.0 ? radiosity[met].rgb : vec3(0.0), 1.0);
        }
    }
    arriving[i] = vec4(sum.rgb / max(sum.w, 1.0), 1.0);
}
