// Round hairs as ribbons. Lengths are in samples, which are squares of side 1; a square is taken as if it stood along the hair.

// The part of a sample that a straight ribbon of this width covers whose axis is `away` from the sample's middle. Integrated over
// `away` it is the width.
float ribbon_coverage(float away, float width) {
    return clamp(0.5 * (width + 1.0) - abs(away), 0.0, min(width, 1.0));
}

// The part of a sample that lies between both ends of a hair; it is this far from either, negative beyond it.
float within_ends(float from_root, float to_tip) {
    return clamp(min(from_root, 0.5) + min(to_tip, 0.5), 0.0, 1.0);
}

// How far the near side of a round hair stands out towards the eye, in radii; for one that is narrower than a sample, the mean.
float height_of_tube(float away, float width) {
    if (width < 1.0) return 0.785398163;
    float h = 2.0 * away / width;
    return sqrt(max(1.0 - h * h, 0.0));
}
