// How opaque hair is along a ray through the grid.
#include "hair_light/extinction.glsl"
#include "lib/relief_box.glsl"

const float INVERSE_SQRT_2PI = 0.398942280;
const float PI_LESS_1 = 2.14159265;

float hair_extinction_at(vec3 at, vec3 d) {
    vec4 a = textureLod(across, at, 0.0);
#if ORIENTED
    return hair_extinction(a, textureLod(between, at, 0.0).xyz, d);
#else
    return a.x;
#endif
}

// Part of the way from a point on a hair to a light, up to a length, that is known to be free of other hair because the way to the eye is:
// the two ways leave together, and part by an angle. Of fibres beside each other that would hide one at a distance s, 1 - s / joint
// would hide both. Kuusk 1991, "The Hot Spot Effect in Plant Canopy Reflectance", with cylinders for leaves.
float free_length(float s, float joint) {
    float within = min(s, joint);
    return joint > 0.0 ? within - 0.5 * within * within / joint : 0.0;
}

// Part of the hair itself, as the grid holds it, that is beyond the way that eye and light share. With s counted in deviations of the blur
// along the ray and J = joint / deviation it is the integral of sqrt(2 / pi) exp(-s^2 / 2) min(s / J, 1) over s > 0, which is
// sqrt(2 / pi) (1 - exp(-J^2 / 2)) / J + erfc(J / sqrt(2)). Fitted at both ends, by q = sqrt(2 / pi) / J: q where J is large, and
// 1 - 1 / (pi q) where it is small. In between it is up to .024 too small (at J = .85) and .014 too large (at J = 3.6).
float own_part(float joint, float deviation) {
    float q = 2.0 * INVERSE_SQRT_2PI / max(joint / deviation, 1e-6);  // where nothing is shared the part is 1 to rounding
    return 1.0 - 1.0 / (1.0 + q * (1.0 + PI_LESS_1 * q / (1.0 + q)));
}

// Optical depth of other hair between a point on a hair of a radius and the grid's border, or a light `end` away, along the unit vector
// d. The point is seen along `to_eye`; a zero vector if nobody knows.
// What the grid holds of the hair itself, blurred over cells and their interpolation (a variance of h^2 / 4 along each axis), is left
// out: a straight fibre of diameter 2 r has r / sqrt(2 pi variance) on either side of itself, by the variance across fibre and ray.
float hair_optical_depth(vec3 position, vec3 d, float end, vec3 tangent, float radius, vec3 to_eye) {
    vec3 size = cell_size(), cells_crossed = d / size, at = (position - grid_corner()) / size;
    float stride = 1.0 / (float(STEPS_A_CELL) * max(abs(cells_crossed.x), max(abs(cells_crossed.y), abs(cells_crossed.z))));
    int entered;
    float length_inside = min(box_span(at, cells_crossed, vec3(0.0), vec3(CELLS), entered).y, end), sum = 0.0;

    vec3 aside = cross(tangent, d), eye_aside = cross(tangent, to_eye);
    float sine = length(aside), apart = length(eye_aside) * sine;
    float cosine = apart > 1e-6 ? clamp(dot(aside, eye_aside) / apart, -1.0, 1.0) : -1.0;
    float joint = JOINT * radius * sqrt((1.0 + cosine) / max(1.0 - cosine, 1e-6)) / max(sine, 1e-3);

    int steps = int(ceil(length_inside / stride));
    float free = 0.0;
    for (int i = 0; i < steps; ++i) {
        float from = float(i) * stride, part = min(stride, length_inside - from);
        float now = free_length(from + part, joint);
        sum += (part - (now - free)) * hair_extinction_at((at + (from + 0.5 * part) * cells_crossed) / float(CELLS), d);
        free = now;
    }
    if (sine < 1e-6) return sum;  // along the hair there is no side to leave it by
    vec3 T = tangent / size;
    float across_ray = 0.5 * length(size * aside) / sine, along_ray = 0.5 * length(T) / length(cross(T, cells_crossed));
    return max(sum - own_part(joint, along_ray) * INVERSE_SQRT_2PI * radius / across_ray, 0.0);
}
