// What reaches a point on a hair straight from the lights, past meshes and other hair.
#include "lib/beam.glsl"
#include "hair_light/march.glsl"
#include "indirect/direct_light.glsl"

struct Lit {
    vec3 to_light;
    vec3 irradiance;  // across the beam
};

// The map is looked up `outside` of the point, and some texels towards the light: a fibre is too thin to shade itself, and its root is on
// the skin. `to_eye` is that of hair_optical_depth.
Lit light_on_hair(int index, vec3 position, vec3 outside, vec3 tangent, float radius, vec3 to_eye) {
    Beam beam = beam_of(lights[index], position);
    vec3 to_light = -beam.travel;
    if (light_visibility(index, position + outside, to_light) == 0.0) return Lit(to_light, vec3(0.0));
#if SHADOWED
    float end = int(lights[index].place_kind.w) == PARALLEL ? 3e38 : distance(lights[index].place_kind.xyz, position);
    float kept = exp(-hair_optical_depth(position, to_light, end, tangent, radius, to_eye));
#else
    float kept = 1.0;
#endif
    return Lit(to_light, beam.irradiance * kept);
}
