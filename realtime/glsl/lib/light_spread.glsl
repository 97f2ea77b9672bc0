#include "lib/lights.glsl"

// Tangent of the angle that a light's radius is seen under: of a ball around `place_kind`, whose cross-section is its area, or of a
// disk that is as large as a facet. Nothing but a point is seen from within a ball.
float light_spread(Light light, vec3 position) {
    int kind = int(light.place_kind.w);
    vec3 v = light.place_kind.xyz - position;
    float r2 = light.axis_area.w / PI, d2 = dot(v, v);
    if (kind == PARALLEL || r2 >= d2) return 0.0;
    if (kind == POINT) return sqrt(r2 / (d2 - r2));
    return sqrt(r2 * abs(dot(v, light.axis_area.xyz)) * inversesqrt(d2) / d2);
}
