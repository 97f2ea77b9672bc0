// How much of the lens, a disk of radius and area 1, two parts of it have in common, by their areas and first moments.
// The largest first moment that an area allows is that of the part beyond a chord: in the middle 2 / (3 pi), elsewhere
// by a fit to 3 % of that.
float largest_moment(float area) {
    return 0.2122 * pow(max(4.0 * area * (1.0 - area), 0.0), 0.94);
}
// Independent parts have the product of their areas in common; parts on the same side, or on opposite ones, as much or
// as little as their areas allow (Frechet's bounds).
float overlap(float a, vec2 moment_a, float b, vec2 moment_b) {
    float largest = largest_moment(a) * largest_moment(b);
    float correlation = largest > 1e-6 ? clamp(dot(moment_a, moment_b) / largest, -1.0, 1.0) : 0.0;
    return mix(a * b, correlation < 0.0 ? max(0.0, a + b - 1.0) : min(a, b), abs(correlation));
}
