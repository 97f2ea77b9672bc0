// The sensor's ray through a sample, in the relief's grid: it begins at the sensor with t = -1.
uniform vec3 ray_anchor;
uniform vec3 ray_forward;
uniform vec3 ray_right;
uniform vec3 ray_up;

void view_ray(ivec2 sample_at, ivec2 size, out vec3 o, out vec3 d) {
    vec2 ndc = (2.0 * vec2(sample_at) + 1.0) / vec2(size) - 1.0;
    vec3 across = ndc.x * ray_right + ndc.y * ray_up;
    o = ray_anchor + across;
    d = ray_forward + across;
}
