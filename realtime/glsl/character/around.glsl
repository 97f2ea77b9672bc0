// The mean radiance around a place, over the rays that were traced from it.
#include "character/places.glsl"
#include "lib/sky.glsl"
layout(binding = 5) uniform sampler2D sky;
layout(std430, binding = 1) readonly buffer Radiosity { vec4 radiosity[]; };
layout(std430, binding = 3) readonly buffer Hits { int hits[]; };

vec3 mean_radiance(int place) {
    vec3 sum = vec3(0.0);
    for (int ray = 0; ray < directions; ++ray) {
        int met = hits[ray * place_count + place];
        if (met >= 0) sum += radiosity[met].rgb;
        else if (met == -1) {
            vec3 d = ray_direction(place, ray);
            sum += textureLod(sky, sky_uv(d, float(textureSize(sky, 0).y)), 0.0).rgb;
        }
    }
    return sum / float(directions);
}
