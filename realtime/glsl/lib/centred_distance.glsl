// Distance from the camera to a point less the distance to the subject's centre, without the cancellation of subtracting the
// two: (a² - b²) / (a + b) for a = |offset + v|, b = |offset|. `v` is the point seen from the centre, `offset` the centre seen
// from the camera; the error is that of `v`, however far away the camera is.
float centred_distance(vec3 v, vec3 offset) {
    return dot(v, v + 2.0 * offset) / (length(v + offset) + length(offset));
}
