// Logarithm of the modified Bessel function of order 0. Abramowitz & Stegun 1964, "Handbook of Mathematical Functions", eqs. 9.8.1
// and 9.8.2: within 2e-7 of the function.
float log_i0(float x) {
    if (x < 3.75) {
        float t = x / 3.75;
        t *= t;
        return log(1.0 + t * (3.5156229 + t * (3.0899424 + t * (1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813))))));
    }
    float t = 3.75 / x;
    float series = 0.39894228 + t * (0.01328592 + t * (0.00225319 + t * (-0.00157565 + t * (0.00916281
        + t * (-0.02057706 + t * (0.02635537 + t * (-0.01647633 + t * 0.00392377)))))));
    return x - 0.5 * log(x) + log(series);
}

// d'Eon, Francois, Hill, Letteri, Aubry 2011, "An Energy-Conserving Hair Reflectance Model", eq. 7: the longitudinal distribution of a
// lobe. Sines and cosines are those of inclinations to the plane across the fibre; a mirror would send light to sin_o = -sin_i.
// 1 - cos(theta_i + theta_o) is taken from the sine where the cosine would cancel.
float fibre_longitudinal(float sin_i, float cos_i, float sin_o, float cos_o, float variance) {
    float k = 1.0 / variance, c = k * cos_i * cos_o;
    float sine = sin_i * cos_o + cos_i * sin_o, cosine = cos_i * cos_o - sin_i * sin_o;
    float off = cosine > 0.0 ? sine * sine / (1.0 + cosine) : 1.0 - cosine;
    return exp(log_i0(c) - c - k * off) * k / (1.0 - exp(-2.0 * k));
}

// Marschner et al. 2003, "Light Scattering from Human Hair Fibers", section 4: scales turn a lobe by an angle. `turn` holds its sine
// and cosine; x is the sine, y the cosine of the inclination, before and after.
vec2 fibre_tilted(vec2 inclination, vec2 turn) {
    return vec2(inclination.x * turn.y + inclination.y * turn.x, abs(inclination.y * turn.y - inclination.x * turn.x));
}
