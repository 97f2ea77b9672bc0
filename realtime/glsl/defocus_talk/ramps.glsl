// Weights of the outer sums by the depth buffer's value f, as the talk prints them: with a slope of 1 and a start of 0.85.

// Far pass: two rings, the second at its full weight where `slope` f is 1.
vec2 far_blur(float f, float slope) {
    return clamp((vec2(f * slope) - vec2(0.0, 1.0) * 0.5) * 2.0, 0.0, 1.0);
}

// Near pass: one ring; only what lies behind the subject is blurred.
float near_blur(float f, float start) {
    return clamp((f - start) * (1.0 / (1.0 - start)), 0.0, 1.0);
}
