// What reaches a point inside the subject from one light without having been scattered; the bound view is that light's.
#include "lib/beam.glsl"
#include "translucency/view.glsl"
layout(std430, binding = 3) readonly buffer Lights { Light lights[]; };
uniform int light_index;
uniform vec3 centre;
uniform vec3 sigma_t;

vec3 unscattered_fluence(vec3 v, float inside) {
    return beam_of(lights[light_index], centre + v).irradiance * exp(-sigma_t * max(inside, 0.0));
}
