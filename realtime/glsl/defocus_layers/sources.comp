#version 430
// The samples of one octave, gathered into texels whose size suits their blur: what a texel hands to each place in its
// disk (rgba), and the disk's signed radius.
#include "defocus_layers/octave.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D radiance;
layout(binding = 1) uniform sampler2D coc;
layout(binding = 2) uniform sampler2D disk_areas;  // [px^2] by radius / largest radius of the octave (x) and octave (y)
layout(binding = 0, rgba32f) writeonly uniform image2D spread;
layout(binding = 1, r32f) writeonly uniform image2D radius;
uniform int octave;
uniform int side;  // samples along an edge of a texel
uniform float texel;  // its size [px]
float disk_area(float r) {
    vec2 size = vec2(textureSize(disk_areas, 0));
    float x = r / (finest_radius * exp2(float(octave)));
    return texture(disk_areas, vec2((x * (size.x - 1.0) + 0.5) / size.x, (float(octave) + 0.5) / size.y)).r;
}
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(spread)))) return;
    ivec2 end = min((at + 1) * side, textureSize(coc, 0));
    vec4 sum = vec4(0.0);
    float radii = 0.0, signed_radii = 0.0;
    for (int y = at.y * side; y < end.y; ++y)
        for (int x = at.x * side; x < end.x; ++x) {
            float c = texelFetch(coc, ivec2(x, y), 0).r;
            if (octave_of(abs(c)) != octave) continue;
            vec4 seen = texelFetch(radiance, ivec2(x, y), 0);
            sum += seen;
            radii += seen.a * abs(c);
            signed_radii += seen.a * c;
        }
    if (sum.a > 0.0) {
        float mean = radii / sum.a;
        sum *= texel * texel / float(side * side) / disk_area(mean);
        radii = signed_radii < 0.0 ? -mean : mean;
    }
    imageStore(spread, at, sum);
    imageStore(radius, at, vec4(radii));
}
