// Places from which rays are traced, each in directions of its own.
#include "lib/hemisphere.glsl"
struct Place {
    vec4 position;
    vec4 normal;
};
layout(std430, binding = 2) readonly buffer Places { Place places[]; };
uniform int place_count;
uniform int directions;
uniform int stride;

vec3 ray_direction(int place, int ray) {
    return cosine_direction((stride * place) % 65536 + ray, places[place].normal.xyz);
}
