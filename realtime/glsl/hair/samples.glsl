// Points along all hairs, SEGMENTS + 1 on each.
struct Sample {
    vec4 position_radius;
    vec4 tangent;  // a unit vector
};
layout(std430, binding = 5) buffer Samples { Sample samples[]; };
