#version 430
// Add a view, the mean over the GRID x GRID samples of each pixel, times a weight, to the sum of those before it, and its
// square to a sum of squares.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D view;
layout(binding = 0, rgba32f) uniform image2D sum;
layout(binding = 1, rgba32f) uniform image2D sum_of_squares;
uniform float weight;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(sum)))) return;
    vec4 seen = vec4(0.0);
    for (int y = 0; y < GRID; ++y)
        for (int x = 0; x < GRID; ++x)
            seen += texelFetch(view, pixel * GRID + ivec2(x, y), 0) / float(GRID * GRID);
    imageStore(sum, pixel, imageLoad(sum, pixel) + weight * seen);
    imageStore(sum_of_squares, pixel, imageLoad(sum_of_squares, pixel) + weight * seen * seen);
}
