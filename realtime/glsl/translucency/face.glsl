in vec3 from_centre;
flat in vec3 corner;

// Where on its face a fragment is, seen from the subject's centre. On a face hardly wider than a rounding error its
// interpolation may divide by nothing; a corner of the face is then as near as any place on it that is known.
vec3 place_on_face() {
    return any(isnan(from_centre)) || any(isinf(from_centre)) ? corner : from_centre;
}
