// Point i of the R2 sequence (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences") as a direction about a
// unit normal, as dense as the cosine to it.
vec3 cosine_direction(int i, vec3 normal) {
    vec2 u = fract(0.5 + float(i) * vec2(0.754877666, 0.569840291));
    float r = sqrt(u.x), phi = 6.28318530717959 * u.y;
    vec3 side = normalize(cross(normal, abs(normal.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
    return r * cos(phi) * side + r * sin(phi) * cross(normal, side) + sqrt(1.0 - u.x) * normal;
}
