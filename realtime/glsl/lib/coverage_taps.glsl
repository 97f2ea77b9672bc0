// Places spread like a Gaussian of standard deviation 1: as many in each ring as the Gaussian has mass there, turned by the golden
// angle from one to the next (Vogel 1979, "A better way to construct the sunflower head", eq. 1, for the angle).
vec2 gaussian_tap(int i, int count) {
    float radius = sqrt(-2.0 * log(1.0 - (float(i) + 0.5) / float(count)));
    float angle = 2.39996323 * float(i);
    return radius * vec2(cos(angle), sin(angle));
}
