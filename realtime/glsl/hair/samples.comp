#version 430
// Points along all hairs, and which way hairs run there.
#include "hair/samples.glsl"
#include "hair/strands.glsl"
#include "lib/bezier.glsl"
layout(local_size_x = 64) in;
uniform int count;

// Which way a hair of length 0 runs: it covers nothing, so any unit vector will do.
const vec3 NOWHERE = vec3(0.0, 1.0, 0.0);

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) return;
    int strand = i / (SEGMENTS + 1);
    float t = float(i - strand * (SEGMENTS + 1)) / float(SEGMENTS);
    vec4 root = strand_points[4 * strand];
    vec3 b = strand_points[4 * strand + 1].xyz - root.xyz;
    vec3 c = strand_points[4 * strand + 2].xyz - root.xyz;
    vec3 d = strand_points[4 * strand + 3].xyz - root.xyz;
    vec3 along = bezier_derivative(vec3(0.0), b, c, d, t);
    // Where neighbouring control points coincide, a curve leaves the one and reaches the other along the line to the next that does not.
    float size2 = max(dot(b, b), max(dot(c, c), dot(d, d)));
    vec3 others[3] = t < 0.5 ? vec3[3](c, d, b) : vec3[3](d - b, d, d - c);
    for (int k = 0; k < 3 && dot(along, along) <= 1e-12 * size2; ++k) along = others[k];
    vec3 tangent = size2 > 0.0 ? normalize(along) : NOWHERE;
    samples[i] = Sample(vec4(root.xyz + bezier_point(vec3(0.0), b, c, d, t), root.w), vec4(tangent, 0.0));
}
