// Octave k holds what is blurred by at most finest_radius 2^k px, and by more than half of that for k > 0.
uniform float finest_radius;
int octave_of(float radius) {
    return int(ceil(log2(max(radius, finest_radius) / finest_radius)));
}
