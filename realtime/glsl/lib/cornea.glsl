// Light that reaches the iris through the cornea, which bends and focuses it.
#include "lib/eye.glsl"
#include "lib/fresnel.glsl"
#include "lib/refract.glsl"

// Coddington's equations (Kingslake & Johnson 2010, "Lens Design Fundamentals", section 11.1): the curvatures of the wavefront
// of a source at 1 / inverse_r behind a surface of that curvature (0: flat), across the plane of incidence (x) and along it (y).
// Positive ones converge.
vec2 wavefront_curvatures(float cos_i, float cos_t, float n, float curvature, float inverse_r) {
    float power = (n * cos_t - cos_i) * curvature;
    return vec2(power - inverse_r, (power - cos_i * cos_i * inverse_r) / (cos_t * cos_t)) / n;
}

// By how much the irradiance of a beam of these curvatures has grown at the distance s: each leaves 1 - s k of its width.
float focus(vec2 curvatures, float s) {
    vec2 left = 1.0 - s * curvatures;
    // At a focus the irradiance is infinite in a point, never over a pixel: no more than a hundredfold.
    return 1.0 / max(abs(left.x * left.y), 0.01);
}

float refracted_cosine(float cos_i, float n) {
    return sqrt(1.0 - (1.0 - cos_i * cos_i) / (n * n));
}

// How light gets from a source to a point on the iris.
struct Entry {
    vec3 point;      // where it enters the cornea
    vec3 normal;     // outer normal there
    vec3 to_light;   // unit vector to the source from there
    float inverse_r; // 1 / distance of the source, 0 for one infinitely far away
    vec3 to_entry;   // unit vector from the iris to the entry, inside
    float s;         // distance from the entry to the iris
};

// `place` is the source (w = 1) or the direction to it (w = 0). Of all points of the cornea the entry is the one at which the
// refracted light hits p. Fixed point: bend the light at the present guess, and follow it back from p to the next. All guesses
// lie in the plane of p, source and centre, where that map has the slope s k with Coddington's k along the plane of incidence:
// dividing a step by 1 - s k makes it one of Newton's. Near a focus it is kept from growing more than tenfold.
Entry cornea_entry(Eye e, vec3 p, vec4 place, int steps) {
    vec3 c = on_axis(e.cornea_centre);
    Entry x;
    x.to_entry = normalize(place.xyz - place.w * p);
    for (int i = 0; i <= steps; ++i) {
        vec2 t;
        sphere_roots(e.cornea_radius, p - c, x.to_entry, t);
        x.s = t.y;
        x.normal = normalize(p + t.y * x.to_entry - c);
        x.point = c + e.cornea_radius * x.normal;
        vec3 v = place.xyz - place.w * x.point;
        x.inverse_r = place.w / length(v);
        x.to_light = normalize(v);
        if (i == steps) break;
        vec3 inward;
        refract_through(-x.to_light, x.normal, 1.0 / e.ior, inward);
        float cos_i = dot(x.normal, x.to_light);
        float k = wavefront_curvatures(cos_i, refracted_cosine(cos_i, e.ior), e.ior, 1.0 / e.cornea_radius, x.inverse_r).y;
        x.to_entry = normalize(x.to_entry - (inward + x.to_entry) / max(1.0 - x.s * k, 0.1));
    }
    return x;
}

// Irradiance on the iris per unit of irradiance on a plane that faces the source at the entry, if the beam kept its width
// inside.
float cornea_transfer(Eye e, Entry x, vec3 iris_normal) {
    float cos_i = dot(x.normal, x.to_light);
    float cos_iris = dot(iris_normal, x.to_entry);
    if (cos_i <= 0.0 || cos_iris <= 0.0 || !leaves_cornea(e, x.point, x.to_light)) return 0.0;
    return (1.0 - F_dielectric(cos_i, e.front_ior)) * cos_i / refracted_cosine(cos_i, e.ior) * cos_iris;
}

// By how much the cornea concentrates light on its way to the iris.
float cornea_focus(Eye e, Entry x) {
    float cos_i = dot(x.normal, x.to_light);
    float cos_t = refracted_cosine(cos_i, e.ior);
    return focus(wavefront_curvatures(cos_i, cos_t, e.ior, 1.0 / e.cornea_radius, x.inverse_r), x.s);
}

// The same if beams spread inside as they did on their way from the source.
float unfocused_spread(Entry x) {
    float left = 1.0 / (1.0 + x.s * x.inverse_r);
    return left * left;
}

// Irradiance on the iris at p, per unit of irradiance on a plane across a beam that comes straight through the cornea.
float straight_transfer(Eye e, vec3 p, vec3 to_light, vec3 iris_normal) {
    vec2 t;
    vec3 c = on_axis(e.cornea_centre);
    sphere_roots(e.cornea_radius, p - c, to_light, t);
    vec3 x = p + t.y * to_light;
    if (!leaves_cornea(e, x, to_light)) return 0.0;
    return (1.0 - F_dielectric(dot(normalize(x - c), to_light), e.front_ior)) * max(dot(iris_normal, to_light), 0.0);
}
