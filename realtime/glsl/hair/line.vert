#version 430
// Segments of hairs as lines.
#include "hair/samples.glsl"
#include "hair/strands.glsl"
#ifdef SHADED
layout(std430, binding = 3) readonly buffer Radiance { vec4 hair_radiance[]; };
#endif
uniform mat4 world_to_clip;
out vec3 radiance;
void main() {
    int segment = gl_VertexID / 2;
    int strand = segment / SEGMENTS;
    int at = segment + strand + gl_VertexID % 2;
    radiance = vec3(0.0);
#ifdef SHADED
    radiance = strand_colors[strand].rgb * hair_radiance[at].rgb;
#endif
    gl_Position = world_to_clip * vec4(samples[at].position_radius.xyz, 1.0);
}
