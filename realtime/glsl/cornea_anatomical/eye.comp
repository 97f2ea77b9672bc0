#version 430
// The eye by rays through its true spheres, one a sample. What the sensor sees of it is exact up to the iris.
#include "cornea_anatomical/view.glsl"
#include "eye/iris_light.glsl"
#include "lib/disk.glsl"
#include "lib/film.glsl"

struct Disk {
    vec4 centre_radius;
    vec4 normal;
    vec4 radiance;
};
layout(std430, binding = 5) readonly buffer Disks { Disk disks[]; };
layout(binding = 2) uniform sampler2D returned;
#ifdef AMONG
layout(binding = 3) uniform sampler2D around_map;  // w: which kind of surface is seen; others stay as they are
#endif
uniform int disk_count;
uniform vec3 sclera_albedo;
uniform float internal_reflectance;

// Irradiance that the cornea throws back onto the iris.
vec3 returned_irradiance(vec3 p) {
#ifdef INTERREFLECTION
    float phi = atan(-p.z, p.x) / (2.0 * PI);
    return textureLod(returned, vec2(phi, length(p.xz) / eyeball.limbus_radius), 0.0).rgb;
#else
    return vec3(0.0);
#endif
}

// Radiance that leaves the iris and arrives outside: a beam that leaves the denser side widens, which costs n^2.
vec3 iris_radiance(vec3 point, vec3 normal) {
    vec3 irradiance = iris_irradiance(point, normal) + returned_irradiance(point);
    return iris_reflectance(point) * irradiance / (PI * eyeball.ior * eyeball.ior);
}

vec3 sclera_radiance(vec3 point, vec3 normal, float cos_o) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        Beam beam = beam_of(lights[i], point);
        float cos_i = -dot(normal, beam.travel);
        if (cos_i <= 0.0 || !leaves_sclera(eyeball, point, -beam.travel)) continue;
        sum += cos_i * beam.irradiance * film_brdf(sclera_albedo, cos_i, cos_o, eyeball.front_ior, internal_reflectance);
    }
#ifdef SKY
    for (int i = 0; i < SKY_RAYS; ++i) {
        vec3 d = cosine_direction(i, normal);
        if (!leaves_sclera(eyeball, point, d)) continue;
        vec3 brdf = film_brdf(sclera_albedo, dot(d, normal), cos_o, eyeball.front_ior, internal_reflectance);
        sum += PI / float(SKY_RAYS) * brdf * sky_radiance(d);
    }
#endif
    return sum;
}

// The wet highlight of a disk light is its mirror image. What the eye mirrors of itself is left out.
vec3 mirror_image(vec3 point, vec3 direction, bool on_cornea) {
    if (on_cornea ? !leaves_cornea(eyeball, point, direction) : !leaves_sclera(eyeball, point, direction)) return vec3(0.0);
    for (int i = 0; i < disk_count; ++i)
        if (disk_hit(point, direction, disks[i].centre_radius.xyz, disks[i].normal.xyz, disks[i].centre_radius.w))
            return disks[i].radiance.rgb;
    return mirrored_radiance(direction);
}

vec3 radiance_along(vec3 d) {
    vec3 x, n, p, n_iris;
    bool is_cornea;
    if (!eye_hit(eyeball, view_origin, d, x, n, is_cornea)) return vec3(0.0);
    float cos_o = -dot(d, n);
    float F = F_dielectric(cos_o, eyeball.front_ior);
    vec3 made = is_cornea && sees_iris(d, x, n, p, n_iris) ? (1.0 - F) * iris_radiance(p, n_iris) : vec3(0.0);
#ifdef WHOLE_EYE
    if (!is_cornea) made = sclera_radiance(x, n, cos_o);
    made += F * mirror_image(x, reflect(d, n), is_cornea);
#endif
    return made;
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(shaded)))) return;
#ifdef AMONG
    if (texelFetch(around_map, at, 0).w != float(AMONG)) return;
#endif
    imageStore(shaded, at, vec4(radiance_along(view_ray(at)), 1.0));
}
