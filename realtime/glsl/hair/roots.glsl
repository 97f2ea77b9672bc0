// Roots of hairs on a deformed surface, and the frames in which hairs stand there.
#include "lib/surface_tangent.glsl"
struct Root {
    uvec4 corners;  // of the triangle that holds it; w: 1 where the chart is mirrored
    vec4 place;     // barycentric weights of the second and third corner; weights of the edges to them in dP/du
    vec4 shape[3];  // control points but the first, in the frame of the root
    vec4 color_radius;
};
layout(std430, binding = 0) readonly buffer Roots { Root roots[]; };
layout(std430, binding = 1) readonly buffer Positions { vec4 positions[]; };
layout(std430, binding = 2) readonly buffer Normals { vec4 normals[]; };

// The place of root i, relative to the origin of its surface, and the columns of its frame.
void stand_on_surface(uint i, out vec3 place, out mat3 frame) {
    uvec4 c = roots[i].corners;
    vec4 w = roots[i].place;
    vec3 a = positions[c.x].xyz, e = positions[c.y].xyz - a, f = positions[c.z].xyz - a;
    vec3 n = normals[c.x].xyz, m = normals[c.y].xyz - n, o = normals[c.z].xyz - n;
    place = a + w.x * e + w.y * f;
#ifdef NO_HANDEDNESS
    float handedness = 1.0;
#else
    float handedness = c.w == 1u ? -1.0 : 1.0;
#endif
    frame[2] = normalize(n + w.x * m + w.y * o);
    frame[0] = surface_tangent(w.z * e + w.w * f, frame[2]);
    frame[1] = handedness * cross(frame[2], frame[0]);
}
