#version 430
// Light that comes from all around lights a cell evenly before it is scattered: add its first collisions to those of other light,
// or with FLUENCE itself to what light is there.
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Collisions { vec4 collisions[]; };  // and the part of the cell that is inside
layout(std430, binding = 1) buffer Sum { vec4 sum[]; };
uniform vec3 sigma_s;
uniform int count;
void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count || collisions[i].w == 0.0) return;
    vec3 light = collisions[i].rgb;
#ifdef FLUENCE
    light /= max(sigma_s * collisions[i].w, 1e-20);  // a channel without scattering has no collisions either
#endif
    sum[i].rgb += light;
}
