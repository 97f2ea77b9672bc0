// One step of a march through a volume of distances: along t, which is in texture space, by a distance that was measured
// after texture space is stretched by `metric`. Of distances in texture space itself (metric 1) this is the step of NVIDIA
// 2005, "GeForce 7800 GTX demos": distance * normalize(t).
vec3 march_step(float distance, vec3 t, vec3 metric) {
    return distance * t / length(metric * t);
}

// Kaneko et al. 2001, "Detailed Shape Representation with Parallax Mapping", section 3: texture coordinates moved along the
// ray t, which goes down, to where it is as deep as the surface is at `uv`. The depth is in texture space too.
vec2 parallax_uv(vec2 uv, vec3 t, float depth) {
    return uv + depth * t.xy / -t.z;
}
