// NVIDIA 2005, the GeForce 7800 GTX demos, "Wrap diffuse lighting": light beyond the terminator, brighter on the whole by `wrap`.
float wrap_diffuse(vec3 N, vec3 L, float wrap) {
    return max(0.0, (dot(N, L) + wrap) / (1.0 + wrap));
}
