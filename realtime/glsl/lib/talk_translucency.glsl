// NVIDIA 2005, "The GeForce 7800 GTX demos" (talk), part on translucency: "Computing Thickness" and "Areas of Influence".

// Distance between front and back face, normalised so that the longest one is 1.
float normalised_thickness(vec3 front, vec3 back, float longest) {
    return clamp(distance(front, back) / longest, 0.0, 1.0);
}

// pow(dot(V, L), n): V from the fragment to the camera, L from the light to the fragment, both of length 1. The power of a
// negative number is undefined, hence the clamp, which the slide does not show.
float area_of_influence(vec3 V, vec3 L, float n) {
    return pow(max(dot(V, L), 0.0), n);
}
