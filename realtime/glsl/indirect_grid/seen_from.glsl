// How a surfel looks from a place: xyz the direction in which its middle is seen, w its solid angle; 0 from behind.
#include "lib/surfels.glsl"

// From NEAR sides away on, a square is as good as a point that is corrected for its size.
const float NEAR = 4.0;

// Van Oosterom & Strackee 1983, "The Solid Angle of a Plane Triangle", eq. 8; all are unit vectors.
float triangle_solid_angle(vec3 a, vec3 b, vec3 c) {
    return 2.0 * abs(atan(dot(a, cross(b, c)), 1.0 + dot(a, b) + dot(b, c) + dot(c, a)));
}

// An edge's part of the vector irradiance of a polygon; Lambert 1760, "Photometria".
vec3 edge_vector(vec3 a, vec3 b) {
    vec3 normal = cross(a, b);
    float sine = length(normal);
    return sine > 0.0 ? normal * (atan(sine, dot(a, b)) / sine) : vec3(0.0);
}

vec4 seen_from(vec3 place, Surfel s) {
    float area = s.position_area.w;
    if (area == 0.0) return vec4(s.position_area.xyz, s.normal_solid_angle.w);
    vec3 v = s.position_area.xyz - place, normal = s.normal_solid_angle.xyz;
    float r2 = dot(v, v), facing = -dot(normal, v);
    if (facing <= 0.0) return vec4(0.0);
    // A disk of radius a at a distance d on its axis fills pi a^2 / (d^2 + 3/4 a^2), but for terms in (a / d)^4.
    if (r2 > NEAR * NEAR * area) return vec4(v * inversesqrt(r2), area * facing * inversesqrt(r2) / (r2 + 0.238732415 * area));
    vec3 x = normalize(cross(normal, abs(normal.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
    vec3 y = cross(normal, x);
    float half_side = 0.5 * sqrt(area);
    vec3 a = normalize(v + half_side * (-x - y)), b = normalize(v + half_side * (x - y));
    vec3 c = normalize(v + half_side * (x + y)), d = normalize(v + half_side * (y - x));
    vec3 middle = edge_vector(a, b) + edge_vector(b, c) + edge_vector(c, d) + edge_vector(d, a);
    middle *= dot(middle, normal) > 0.0 ? -1.0 : 1.0;
    return vec4(normalize(middle), triangle_solid_angle(a, b, c) + triangle_solid_angle(a, c, d));
}

// What the harmonics of band 0, 1 and 2 lose because a surfel is no point: it is taken as a cap of its solid angle. The mean of
// the Legendre polynomial over a cap with the cosine c at its edge is 1, (1 + c) / 2, c (1 + c) / 2.
float band_factor(int k, float solid_angle) {
    float c = 1.0 - 0.159154943 * solid_angle;
    return k == 0 ? 1.0 : (k < 4 ? 0.5 : 0.5 * c) * (1.0 + c);
}

// The solid angles around a place in a closed room sum to 4 pi: dividing by what they reach removes what the size of the surfels
// costs. In the open they may sum to less; more is never right.
float sphere_scale(float sum, float closed) {
    return 12.566370614 / mix(max(sum, 12.566370614), max(sum, 1e-6), closed);
}
