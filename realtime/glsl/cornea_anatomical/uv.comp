#version 430
// The iris' coordinate that each sample sees: exact, by rays through the true spheres.
#include "cornea_anatomical/view.glsl"

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(shaded)))) return;
    vec3 d = view_ray(at), x, n, p, n_iris;
    bool is_cornea;
    bool found = eye_hit(eyeball, view_origin, d, x, n, is_cornea) && is_cornea && sees_iris(d, x, n, p, n_iris);
    imageStore(shaded, at, found ? vec4(iris_uv(eyeball, p), 0.0, 1.0) : vec4(0.0));
}
