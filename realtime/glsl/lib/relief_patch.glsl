// A bilinear patch over the unit square; `corners` are its heights at (0, 0), (1, 0), (0, 1) and (1, 1).
const float NO_HIT = 1e30;

float patch_height(vec4 corners, vec2 at) {
    vec2 along_x = mix(corners.xz, corners.yw, at.x);
    return mix(along_x.x, along_x.y, at.y);
}

// Partial derivatives of the height.
vec2 patch_slope(vec4 corners, vec2 at) {
    vec2 along_x = corners.yw - corners.xz, along_y = corners.zw - corners.xy;
    return vec2(mix(along_x.x, along_x.y, at.y), mix(along_y.x, along_y.y, at.x));
}

// Ramsey, Potter, Hansen 2004, "Ray Bilinear Patch Intersections", for a patch that is a height field: how many lengths of d
// a ray goes until it is no longer above the patch or its continuation; 0 if it begins there, NO_HIT if it never is.
float patch_hit(vec4 corners, vec3 o, vec3 d) {
    float above = o.z - patch_height(corners, o.xy);
    if (above <= 0.0) return 0.0;
    // Above it by above + sinks s + bends s²; roots as 2 c / (-b + ...), which do not cancel.
    float sinks = d.z - dot(patch_slope(corners, o.xy), d.xy);
    float bends = -(corners.x - corners.y - corners.z + corners.w) * d.x * d.y;
    float discriminant = sinks * sinks - 4.0 * bends * above;
    if (discriminant < 0.0) return NO_HIT;
    float root = sqrt(discriminant);
    if (sinks < 0.0) return 2.0 * above / (root - sinks);
    return bends < 0.0 ? (sinks + root) / (-2.0 * bends) : NO_HIT;
}
