#version 430
// The box around all hair, with so much air that no cell is narrower than a fibre.
#include "hair/samples.glsl"
#include "hair_light/grid.glsl"
layout(local_size_x = 64) in;
uniform int count;
shared uint low[3];
shared uint high[3];
void main() {
    int i = int(gl_GlobalInvocationID.x), lane = int(gl_LocalInvocationID.x);
    if (lane < 3) {
        low[lane] = 0xffffffffu;
        high[lane] = 0u;
    }
    barrier();
    if (i < count) {
        vec4 sphere = samples[i].position_radius;
        for (int c = 0; c < 3; ++c) {
            atomicMin(low[c], ordered(sphere[c] - float(CELLS) * sphere.w));
            atomicMax(high[c], ordered(sphere[c] + float(CELLS) * sphere.w));
        }
    }
    barrier();
    if (lane < 3) {
        atomicMin(bounds[lane], low[lane]);
        atomicMax(bounds[3 + lane], high[lane]);
    }
}
