#include "lib/lights.glsl"
const int ELEMENT = 3;  // a short piece of a thin tube along axis_area.xyz; strength is its intensity straight across

struct Beam {
    vec3 travel;      // unit vector along which light arrives
    vec3 irradiance;  // on a plane across it, nothing in its way
};

// A facet counts as a disk of its area, as in disk_form_factor.
Beam beam_of(Light light, vec3 position) {
    int kind = int(light.place_kind.w);
    if (kind == PARALLEL) return Beam(light.axis_area.xyz, light.strength.rgb);
    vec3 v = position - light.place_kind.xyz;
    float r2 = dot(v, v);
    if (r2 == 0.0) return Beam(light.axis_area.xyz, vec3(0.0));  // nothing can be said at the light itself
    vec3 travel = v * inversesqrt(r2);
    float along = dot(travel, light.axis_area.xyz);
    if (kind == FACET)
        return Beam(travel, light.strength.rgb * PI * max(along, 0.0) / (PI * r2 + light.axis_area.w));
    if (kind == ELEMENT) return Beam(travel, light.strength.rgb * sqrt(max(1.0 - along * along, 0.0)) / r2);
    return Beam(travel, light.strength.rgb / r2);
}
