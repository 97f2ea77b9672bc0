#version 430
// What a sample sees without regard to lamps: what its front side receives from all but lamps, over pi, and what kind of surface it
// is; what it emits or, of a kind with a shader of its own, (u, v); what it reflects on the whole.
uniform sampler2D emission_map;
uniform vec3 emission;
uniform float kind;
uniform vec3 on_the_whole;
in vec3 received;
in vec2 uv;
layout(location = 0) out vec4 out_around;
layout(location = 1) out vec4 out_emitted;
layout(location = 2) out vec4 out_whole;
void main() {
    float front = gl_FrontFacing ? 1.0 : 0.0;
    out_around = vec4(front * received, kind);
    out_emitted = vec4(front * emission * textureLod(emission_map, uv, 0.0).rgb, 0.0);
    if (kind >= FIRST_COAT) out_emitted.xy = uv;
    out_whole = vec4(front * on_the_whole, 1.0);
}
