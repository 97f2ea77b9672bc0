/*
name = "mine.hemisphere"
approximates = "indirect_radiance"
summary = "hemisphere ambient: what comes from above and from below, as bright as a closed box would be"
source = "Box: the integrating sphere, e.g. Goebel (1967), Applied Optics 6(1), 125-128."
limits = "Knows no place and no colour of any wall, and no shadow: light is the same everywhere in the box."

[parameters.walls]
default = 0.5
sweep = [0.3, 0.5, 0.7]
bounds = [0.0, 0.99]
summary = "mean reflectance of what surrounds the subject"

[parameters.tilt]
default = 0.2
sweep = [0.0, 0.2, 0.4]
bounds = [-1.0, 1.0]
summary = "by how much of the mean it is brighter above than at the horizon"
*/
#version 430
#include "own/interface.glsl"
#include "own/lights.glsl"
uniform float walls;
uniform float tilt;

void main() {
    vec3 power = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        int kind = int(lights[i].place_kind.w);
        power += lights[i].strength.rgb * (kind == POINT ? 4.0 * PI : kind == FACET ? PI : 0.0);
    }
    vec3 s = scene_high - scene_low;
    float area = 2.0 * (s.x * s.y + s.y * s.z + s.z * s.x);
    vec3 irradiance = power / area * walls / (1.0 - walls) * (1.0 + tilt * normalize(normal).y);
    color = vec4(albedo() / PI * irradiance, 1.0);
}
