#include "lib/cube.glsl"
#include "lib/lights.glsl"

// Where a point lies in a light's row of the atlas: xy in texels of the row, z the distance it would have in the map, w the
// size of a texel at that distance. `scene_radius` is half the width of what a PARALLEL light's map shows.
vec4 shadow_coordinates(Light light, vec3 position, float side, float scene_radius) {
    vec3 v = position - light.place_kind.xyz;
    if (int(light.place_kind.w) == PARALLEL) {
        vec3 f = light.axis_area.xyz;
        vec3 helper = abs(f.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
        vec3 right = normalize(cross(f, helper));
        vec2 st = vec2(dot(v, right), dot(v, cross(right, f))) / scene_radius;
        return vec4((0.5 * st + 0.5) * side, dot(v, f), 2.0 * scene_radius / side);
    }
    vec2 st;
    int face = cube_face(v, st);
    float distance = length(v);
    vec3 a = abs(v);
    return vec4((0.5 * st + 0.5) * side + vec2(float(face) * side, 0.0), distance, 2.0 * max(a.x, max(a.y, a.z)) / side);
}
