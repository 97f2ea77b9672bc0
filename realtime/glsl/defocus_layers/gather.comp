#version 430
// Scatter as gather: each pixel sums what the texels around it hand to it, by their disks and not by its own, and the
// first moments of that over the lens, whose radius counts as 1.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D spread;
layout(binding = 1) uniform sampler2D radius;
layout(binding = 0, rgba32f) uniform image2D layer;
layout(binding = 1, rgba32f) uniform image2D moment_x;
layout(binding = 2, rgba32f) uniform image2D moment_y;
uniform float texel;  // size of a source [px]
uniform float edge;  // width over which a disk fades [px]
uniform float reach;  // largest radius of a disk [px]
uniform int margin;  // pixels of the sources beyond the image's border
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(layer)))) return;
    vec2 centre = vec2(pixel + margin) + 0.5;
    float far = reach + 0.5 * edge + 0.25;
    ivec2 low = max(ivec2(ceil((centre - far) / texel - 0.5)), 0);
    ivec2 high = min(ivec2(floor((centre + far) / texel - 0.5)), textureSize(radius, 0) - 1);
    vec4 sum = imageLoad(layer, pixel), sum_x = imageLoad(moment_x, pixel), sum_y = imageLoad(moment_y, pixel);
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) {
            float c = texelFetch(radius, ivec2(x, y), 0).r;
            vec2 d = centre - (vec2(x, y) + 0.5) * texel;
            // A pixel is four points, each a quarter of a pixel off its centre.
            vec2 a = d - 0.25, b = d + 0.25;
            vec4 squares = vec4(dot(a, a), a.x * a.x + b.y * b.y, b.x * b.x + a.y * a.y, dot(b, b));
            float share = dot(clamp((abs(c) - sqrt(squares)) / edge + 0.5, 0.0, 1.0), vec4(0.25));
            if (share == 0.0) continue;
            vec4 given = share * texelFetch(spread, ivec2(x, y), 0);
            // A place u on the lens shifts the texel by c u. What is sharp is seen from all of the lens: u is then 0.
            vec2 u = d * c / (c * c + 0.25 * edge * edge);
            sum += given;
            sum_x += given * u.x;
            sum_y += given * u.y;
        }
    imageStore(layer, pixel, sum);
    imageStore(moment_x, pixel, sum_x);
    imageStore(moment_y, pixel, sum_y);
}
