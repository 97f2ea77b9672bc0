struct Crossing {
    vec3 leaving;
    vec3 mean;  // over the path
};

// Radiance along a path through matter that emits `emitted` per unit of length and takes away `extinction`, both constant.
// Lewis & Miller 1984, "Computational Methods of Neutron Transport", section 4-3. Thin paths go by series, where differences would
// cancel: the first term left out is below float32's precision at 0.1.
Crossing step_characteristic(vec3 entering, vec3 emitted, vec3 extinction, float path) {
    vec3 tau = extinction * path, kept = exp(-tau), divisor = max(tau, 0.1);
    bvec3 is_thin = lessThan(tau, vec3(0.1));
    vec3 averaged = mix((1.0 - kept) / divisor, 1.0 - tau / 2.0 * (1.0 - tau / 3.0 * (1.0 - tau / 4.0)), is_thin);
    vec3 own = mix((1.0 - averaged) / divisor, 0.5 - tau / 6.0 * (1.0 - tau / 4.0 * (1.0 - tau / 5.0)), is_thin);
    return Crossing(entering * kept + emitted * path * averaged, entering * averaged + emitted * path * own);
}
