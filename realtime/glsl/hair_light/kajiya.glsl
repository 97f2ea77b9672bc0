// Fibres in the way of Kajiya & Kay: a diffuse and a glossy part for each hair of the scene.
#include "hair_light/tables.glsl"
#include "lib/kajiya_kay.glsl"

vec3 kajiya_scattering(int hair, vec3 tangent, vec3 to_eye, vec3 to_light) {
    vec4 glossy = fibre_constant(hair, KAJIYA_GLOSSY);
    vec2 parts = kajiya_kay(tangent, to_light, to_eye, glossy.w);
    return fibre_constant(hair, KAJIYA_DIFFUSE).rgb * parts.x + glossy.rgb * parts.y;
}
