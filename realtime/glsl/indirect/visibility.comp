#version 430
// Which surfels each receiver sees past the subject itself: one bit each, 32 to an invocation. Neighbouring invocations are
// neighbouring receivers, whose rays to the same surfel take nearly the same way through the hierarchy.
#include "lib/surfels.glsl"
#include "indirect/bvh.glsl"
layout(local_size_x = 64) in;
struct Receiver {
    vec4 position;
    vec4 normal;
};
layout(std430, binding = 0) readonly buffer Surfels { Surfel surfels[]; };
layout(std430, binding = 1) readonly buffer Receivers { Receiver receivers[]; };
layout(std430, binding = 2) writeonly buffer Bits { uint bits[]; };
uniform int surfel_count;
uniform int receiver_count;
uniform int words;
uniform float offset;

// Segments end this far before a surfel, so that the surface it lies on does not hide it.
const float END = 0.995;

void main() {
    int receiver = int(gl_GlobalInvocationID.x), word = int(gl_GlobalInvocationID.y);
    if (word >= words || receiver >= receiver_count) return;
    vec3 normal = receivers[receiver].normal.xyz;
    vec3 origin = receivers[receiver].position.xyz + offset * normal;
    uint seen = 0u;
    for (int bit = 0; bit < 32; ++bit) {
        int index = 32 * word + bit;
        if (index >= surfel_count) break;
        Surfel s = surfels[index];
        bool is_sky = s.position_area.w == 0.0;
        vec3 to_surfel = is_sky ? s.position_area.xyz : s.position_area.xyz - origin;
        if (dot(normal, to_surfel) <= 0.0) continue;
        if (!is_sky && dot(s.normal_solid_angle.xyz, to_surfel) >= 0.0) continue;
        if (!is_blocked(origin, to_surfel, is_sky ? 3e38 : END)) seen |= 1u << bit;
    }
    bits[receiver * words + word] = seen;
}
