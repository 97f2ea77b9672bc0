#version 430
// The talk's soft shadow: alpha of the blurred cube in the direction from the light. The character does not read it. What faces
// away from the light by its own triangle is not lit.
uniform samplerCube blurred;
uniform vec3 light;
uniform float is_subject;
in vec3 position;
layout(location = 0) out vec4 visibility;
void main() {
    vec3 normal = cross(dFdx(position), dFdy(position));
    vec3 from_light = position - light;
    bool faces_light = dot(gl_FrontFacing ? normal : -normal, from_light) < 0.0;
    float shadow_mult = 1.0;
#ifdef CAPTURED
    if (is_subject == 0.0) shadow_mult = textureLod(blurred, from_light, 0.0).a;
#endif
    visibility = vec4(faces_light ? shadow_mult : 0.0);
}
