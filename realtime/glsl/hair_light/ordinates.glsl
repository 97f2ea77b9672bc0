// The directions in which scattered light travels.
struct Ordinate {
    vec4 travel_weight;  // unit vector, part of 4 pi
    vec4 sky;            // radiance that enters along it from outside
};
layout(std430, binding = 2) readonly buffer Ordinates { Ordinate ordinates[ORDINATES]; };

const float FOUR_PI = 4.0 * 3.14159265358979;
