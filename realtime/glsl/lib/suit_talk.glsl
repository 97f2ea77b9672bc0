// NVIDIA 2005, the GeForce 7800 GTX demos: N.V "is run through a cubic polynomial to smoothen the ramp", and the result "is scaled
// to shift its area of influence". How much of the silhouette's layer covers what lies under it; k are the cubic's coefficients
// over 1 - N.V, scale and shift among them.
float silhouette_ramp(float n_dot_v, vec4 k) {
    float u = 1.0 - clamp(n_dot_v, 0.0, 1.0);
    return clamp(k.x + u * (k.y + u * (k.z + u * k.w)), 0.0, 1.0);
}

// The same talk: a factor that brings the ramp "back to 0 near extreme grazing angles", where N.V is below `width`; the talk does
// not say how.
float silhouette_damping(float n_dot_v, float width) {
    return width > 0.0 ? smoothstep(0.0, width, n_dot_v) : 1.0;
}

// Kilgard 2000, "A Practical and Robust Bump-mapping Technique for Today's GPUs", section 2.5.2: highlights fade where the light
// sinks below the surface, within N.L = 1 / slope.
float self_shadowing(float n_dot_l, float slope) { return clamp(slope * n_dot_l, 0.0, 1.0); }

// The same talk: Final Color = alpha * Layer 2 + (1 - alpha) * Layer 1; a third layer goes over both in the same way.
vec3 composited(vec3 below, vec3 above, float alpha) { return alpha * above + (1.0 - alpha) * below; }

// The same talk: any number of the shader is dot(special, amount), special being 1 and the green of three textures.
float driven(vec4 special, vec4 amount) { return dot(special, amount); }
