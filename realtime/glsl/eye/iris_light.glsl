// Light on the iris that comes through the cornea for the first time. Binds the lights to storage buffer 3.
#include "eye/uniforms.glsl"
#include "eye/surroundings.glsl"
#include "lib/beam.glsl"
#include "lib/cornea.glsl"
#include "lib/hemisphere.glsl"
#include "lib/light_place.glsl"
layout(binding = 1) uniform sampler2D iris_map;
layout(std430, binding = 3) readonly buffer Lights { Light lights[]; };
uniform int light_count;

vec3 iris_reflectance(vec3 p) {
    float r2 = dot(p.xz, p.xz);
    return r2 < eyeball.pupil_radius * eyeball.pupil_radius ? vec3(0.0) : textureLod(iris_map, iris_uv(eyeball, p), 0.0).rgb;
}

vec3 light_on_iris(Light light, vec3 p, vec3 normal) {
#ifdef STRAIGHT
    Beam beam = beam_of(light, p);
    return beam.irradiance * straight_transfer(eyeball, p, -beam.travel, normal);
#else
    Entry x = cornea_entry(eyeball, p, light_place(light), BEND_STEPS);
#ifdef FLAT
    float concentration = unfocused_spread(x);
#else
    float concentration = cornea_focus(eyeball, x);
#endif
    return beam_of(light, x.point).irradiance * cornea_transfer(eyeball, x, normal) * concentration;
#endif
}

// Irradiance from the sky: each direction inside that gets out through the cornea carries n^2 times the radiance it sees.
vec3 sky_on_iris(vec3 p, vec3 normal) {
    vec3 sum = vec3(0.0);
    vec3 c = on_axis(eyeball.cornea_centre);
    for (int i = 0; i < SKY_RAYS; ++i) {
        vec3 d = cosine_direction(i, normal), outward;
        vec2 t;
        sphere_roots(eyeball.cornea_radius, p - c, d, t);
        vec3 q = p + t.y * d;
        vec3 n = normalize(q - c);
        if (!refract_through(d, -n, eyeball.ior, outward) || !leaves_cornea(eyeball, q, outward)) continue;
        sum += (1.0 - F_dielectric(dot(outward, n), eyeball.front_ior)) * sky_radiance(outward);
    }
    return PI * eyeball.ior * eyeball.ior * sum / float(SKY_RAYS);
}

vec3 iris_irradiance(vec3 p, vec3 normal) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < light_count; ++i) sum += light_on_iris(lights[i], p, normal);
#ifdef SKY
    sum += sky_on_iris(p, normal);
#endif
    return sum;
}
