#version 430
// A point of the light: hard shadows.
#include "shadow_soft/receive.glsl"

float seen_part(Receiver r, float height, ivec2 pixel) { return height > 0.0 ? lit_part(r, r.v) : 0.0; }
