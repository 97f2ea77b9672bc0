#version 430
// What each triangle sends out after one more bounce.
#include "character/around.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Lit { vec4 lit[]; };
layout(std430, binding = 6) readonly buffer Reflectances { vec4 reflectances[]; };
layout(std430, binding = 7) writeonly buffer After { vec4 after[]; };

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= place_count) return;
    after[i] = vec4(lit[i].rgb + reflectances[i].rgb * mean_radiance(i), 1.0);
}
