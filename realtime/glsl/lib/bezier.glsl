// A cubic Bezier curve through the first and the last of its control points.

// Farin 2002, "Curves and Surfaces for CAGD", eq. 5.1: Bernstein polynomials of degree 3.
vec3 bezier_point(vec3 a, vec3 b, vec3 c, vec3 d, float t) {
    float s = 1.0 - t;
    return s * s * s * a + 3.0 * s * s * t * b + 3.0 * s * t * t * c + t * t * t * d;
}

// Farin 2002, eq. 5.15: the derivative with respect to t.
vec3 bezier_derivative(vec3 a, vec3 b, vec3 c, vec3 d, float t) {
    float s = 1.0 - t;
    return 3.0 * (s * s * (b - a) + 2.0 * s * t * (c - b) + t * t * (d - c));
}
