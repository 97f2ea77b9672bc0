#version 430
// Light on hairs as demos of 2005 had it: Kajiya & Kay's, with nothing in its way.
#include "hair/samples.glsl"
#include "hair/strands.glsl"
#include "hair_light/kajiya.glsl"
#include "lib/beam.glsl"
layout(std430, binding = 0) writeonly buffer Radiance { vec4 hair_radiance[]; };
layout(std430, binding = 3) readonly buffer Lights { Light lights[]; };
layout(local_size_x = 64) in;
uniform int count;
uniform int per_hair;
uniform int light_count;
uniform vec3 eye;
void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) return;
    vec3 position = samples[i].position_radius.xyz, to_eye = normalize(eye - position), sum = vec3(0.0);
    int hair = int(strand_colors[i / per_hair].w);
    for (int k = 0; k < light_count; ++k) {
        Beam beam = beam_of(lights[k], position);
        sum += beam.irradiance * kajiya_scattering(hair, samples[i].tangent.xyz, to_eye, -beam.travel);
    }
    hair_radiance[i] = vec4(sum, 0.0);
}
