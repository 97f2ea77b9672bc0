#include "lib/sphere.glsl"

// An eye in its own frame: gaze +y, the sclera's centre at the origin. All centres lie on the axis.
// `iris_curvature` 0: the iris is flat. `ior`: of what lies behind the cornea, for refraction. `front_ior`: for reflection.
struct Eye {
    float sclera_radius;
    float cornea_radius;
    float cornea_centre;
    float limbus_radius;
    float limbus_height;
    float apex;
    float iris_plane;
    float iris_curvature;
    float iris_centre;
    float pupil_radius;
    float ior;
    float front_ior;
};

vec3 on_axis(float y) {
    return vec3(0.0, y, 0.0);
}

// The first point of the eye that a ray from outside meets, with its outer normal. The eye is closed, so the ray enters it
// through the near side of one of its spheres. The hit is put back on the sphere, which removes the error along the radius.
bool eye_hit(Eye e, vec3 o, vec3 d, out vec3 point, out vec3 normal, out bool is_cornea) {
    vec2 t;
    vec3 c = on_axis(e.cornea_centre);
    is_cornea = false;
    point = normal = vec3(0.0);
    if (sphere_roots(e.cornea_radius, o - c, d, t) && t.x > 0.0) {
        normal = normalize(o + t.x * d - c);
        point = c + e.cornea_radius * normal;
        is_cornea = point.y > e.limbus_height;
        if (is_cornea) return true;
    }
    if (!sphere_roots(e.sclera_radius, o, d, t) || t.x <= 0.0) return false;
    normal = normalize(o + t.x * d);
    point = e.sclera_radius * normal;
    return point.y <= e.limbus_height;
}

// Whether a ray from a point of the cornea's sphere is one from the cornea, and passes the sclera.
bool leaves_cornea(Eye e, vec3 o, vec3 d) {
    vec2 t;
    if (o.y <= e.limbus_height) return false;
    return !sphere_roots(e.sclera_radius, o, d, t) || t.x <= 0.0 || o.y + t.x * d.y > e.limbus_height;
}

// Whether a ray from a point of the sclera passes the bulge of the cornea.
bool leaves_sclera(Eye e, vec3 o, vec3 d) {
    vec2 t;
    return !sphere_roots(e.cornea_radius, o - on_axis(e.cornea_centre), d, t) || t.x <= 0.0 || o.y + t.x * d.y <= e.limbus_height;
}

// Where a ray inside the eye meets the iris, and the side of it that looks at the cornea. False if it passes beside the rim.
bool iris_hit(Eye e, vec3 o, vec3 d, out vec3 point, out vec3 normal) {
    normal = vec3(0.0, 1.0, 0.0);
    point = o;
    if (d.y >= 0.0) return false;
    point += (e.iris_plane - o.y) / d.y * d;
    bool inside = dot(point.xz, point.xz) <= e.limbus_radius * e.limbus_radius;
    if (!inside || e.iris_curvature == 0.0) return inside;
    vec3 c = on_axis(e.iris_centre);
    vec2 t;
    inside = sphere_roots(e.iris_curvature, point - c, d, t);
    point += t.y * d;
    normal = normalize(c - point);
    return inside;
}

// The texture coordinate of a point on the iris: u along +x, v along -z, 0 to 1 across the rim.
vec2 iris_uv(Eye e, vec3 p) {
    return 0.5 + vec2(p.x, -p.z) / (2.0 * e.limbus_radius);
}

// The point on the iris at some distance from the axis, at some angle from +x to -z, and its normal.
vec3 iris_point(Eye e, float r, float phi, out vec3 normal) {
    vec3 p = vec3(r * cos(phi), e.iris_plane, -r * sin(phi));
    normal = vec3(0.0, 1.0, 0.0);
    if (e.iris_curvature == 0.0) return p;
    p.y = e.iris_centre - sqrt(e.iris_curvature * e.iris_curvature - r * r);
    normal = normalize(on_axis(e.iris_centre) - p);
    return p;
}
