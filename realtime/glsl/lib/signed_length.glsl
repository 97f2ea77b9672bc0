// What a face at `face` with a sign (+1 back, -1 front) adds to the length inside a closed body up to `end`, and to the number of
// bodies that the ray is inside of there. Summed over all faces of the ray, in any order.
vec2 signed_length(float face, float sign, float end) {
    return vec2(sign * min(face, end), face < end ? -sign : 0.0);
}
