#include "lib/lights.glsl"

// Where a light is (w = 1), or the direction to it (w = 0).
vec4 light_place(Light light) {
    return int(light.place_kind.w) == PARALLEL ? vec4(-light.axis_area.xyz, 0.0) : vec4(light.place_kind.xyz, 1.0);
}
