// Weights of the outer sums by the depth buffer's value f, as the talk prints them.

// Far pass: two rings.
vec2 far_blur(float f) {
    return clamp((vec2(f) - vec2(0.0, 1.0) * 0.5) * 2.0, 0.0, 1.0);
}

// Near pass: one ring; only what lies behind the subject is blurred.
float near_blur(float f) {
    return clamp((f - 0.85) * (1.0 / (1.0 - 0.85)), 0.0, 1.0);
}
