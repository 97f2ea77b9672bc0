// A limb's pose: a morph target, then two bones.
uniform mat4 lower_bone;
uniform mat4 upper_bone;
uniform float amount;

// The matrix that skin follows where the upper bone has this weight. Magnenat-Thalmann, Laperriere, Thalmann 1988, "Joint-dependent
// local deformations for hand animation and object grasping" (linear blend skinning).
mat4 blended_bone(float upper_weight) {
    return (1.0 - upper_weight) * lower_bone + upper_weight * upper_bone;
}
