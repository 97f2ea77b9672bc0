#version 430
// Mean over the GRID x GRID samples of each pixel.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D samples;
layout(binding = 0, rgba32f) writeonly uniform image2D resolved;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(resolved)))) return;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < GRID; ++y)
        for (int x = 0; x < GRID; ++x)
            sum += texelFetch(samples, pixel * GRID + ivec2(x, y), 0);
    imageStore(resolved, pixel, sum / float(GRID * GRID));
}
