#include "lib/lambert.glsl"
const int POINT = 0;
const int FACET = 1;
const int PARALLEL = 2;

struct Light {
    vec4 place_kind;
    vec4 axis_area;
    vec4 strength;
};

// Irradiance on a surface from one light, shadows left out.
vec3 unshadowed_irradiance(Light light, vec3 position, vec3 normal) {
    int kind = int(light.place_kind.w);
    if (kind == PARALLEL) return light.strength.rgb * max(dot(normal, -light.axis_area.xyz), 0.0);
    vec3 to_light = light.place_kind.xyz - position;
    if (kind == FACET) {
        float area = light.axis_area.w;
        return light.strength.rgb / area * PI * disk_form_factor(normal, to_light, light.axis_area.xyz, area);
    }
    float r2 = dot(to_light, to_light);
    if (r2 == 0.0) return vec3(0.0);  // nothing can be said at the light itself
    return light.strength.rgb * max(dot(normal, to_light), 0.0) / (r2 * sqrt(r2));
}
