// The sensor's ray through a sample, in the eye's frame, and what it meets.
#include "eye/uniforms.glsl"
#include "lib/refract.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) writeonly uniform image2D shaded;
uniform vec3 view_forward;
uniform vec3 view_right;
uniform vec3 view_up;

vec3 view_ray(ivec2 sample_at) {
    vec2 ndc = (2.0 * vec2(sample_at) + 1.0) / vec2(imageSize(shaded)) - 1.0;
    return normalize(view_forward + ndc.x * view_right + ndc.y * view_up);
}

// The point of the iris that a ray sees which meets the cornea at x.
bool sees_iris(vec3 d, vec3 x, vec3 cornea_normal, out vec3 point, out vec3 normal) {
    vec3 inward;
    refract_through(d, cornea_normal, 1.0 / eyeball.ior, inward);
    return iris_hit(eyeball, x, inward, point, normal);
}
