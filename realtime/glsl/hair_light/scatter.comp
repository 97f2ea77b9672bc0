#version 430
// What hair sends along each ordinate: light that is scattered for the first time, and that which came along the others. The skin's
// first thread finds what the skin reflects.
#include "hair_light/ordinates.glsl"
#include "hair_light/rows.glsl"
layout(std430, binding = 0) readonly buffer Sources { vec4 sources[]; };
layout(std430, binding = 1) readonly buffer Along { vec4 along[]; };
layout(std430, binding = 3) readonly buffer Phases { vec4 phases[]; };  // hair, tangent, leaving along, coming along
layout(std430, binding = 5) writeonly buffer Sent { vec4 sent[]; };
layout(local_size_x = 64) in;

void main() {
    const int cells = CELLS * CELLS * CELLS;
    int index = int(gl_GlobalInvocationID.x), k = int(gl_GlobalInvocationID.y);
    if (index >= cells) return;
    vec4 skin = rows[index].skin, hair = rows[index].hair;
    if (k == 0 && skin.w > 0.0) {
        vec3 coming = vec3(0.0);
        float weights = 0.0;
        for (int j = 0; j < ORDINATES; ++j) {
            vec4 ordinate = ordinates[j].travel_weight, light = along[j * cells + index];
            float weight = ordinate.w * max(-dot(ordinate.xyz, skin.xyz), 0.0);
            coming += weight * light.w * light.rgb;
            weights += weight;
        }
        vec3 radiance = rows[index].irradiance.rgb / (0.25 * FOUR_PI) + coming / weights;
        rows[index].radiance = vec4(rows[index].reflectance.rgb * radiance, 0.0);
    }
    if (hair.x == 0.0) return;
    vec3 sum = sources[k * cells + index].rgb;
    int row = ((int(hair.z) * TANGENTS + int(hair.y)) * ORDINATES + k) * ORDINATES;
    for (int j = 0; j < ORDINATES; ++j) sum += phases[row + j].rgb * along[j * cells + index].rgb;
    sent[k * cells + index] = vec4(sum, 0.0);
}
