#version 430
// Parallax mapping: one lookup of the height where the ray meets the polygon.
#include "displacement/polygon.glsl"
#include "lib/relief_march.glsl"
void main() {
    vec2 uv = texCoord.xy;
    float height = textureLod(heights, between_samples(uv, vec2(textureSize(heights, 0))), 0.0).r;
    show(face == TOP ? parallax_uv(uv, tanEyeVec / extent, 1.0 - height) : uv, face != TOP);
}
