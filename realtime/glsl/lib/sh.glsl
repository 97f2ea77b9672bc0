// Real spherical harmonics to band 2 and their convolution with the clamped cosine.
// Ramamoorthi & Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps", eqs. 3 and 8.

float[9] sh_basis(vec3 d) {
    return float[9](
        0.282094792, 0.488602512 * d.y, 0.488602512 * d.z, 0.488602512 * d.x, 1.092548431 * d.x * d.y,
        1.092548431 * d.y * d.z, 0.315391565 * (3.0 * d.z * d.z - 1.0), 1.092548431 * d.x * d.z,
        0.546274215 * (d.x * d.x - d.y * d.y));
}

// A_l: pi, 2 pi / 3, pi / 4.
float sh_cosine_factor(int i) {
    return i == 0 ? 3.141592654 : (i < 4 ? 2.094395102 : 0.785398163);
}
