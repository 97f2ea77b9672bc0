#version 430
// Add light to what is seen.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D light;
layout(binding = 0, rgba32f) uniform image2D shaded;
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(shaded)))) return;
    imageStore(shaded, at, imageLoad(shaded, at) + vec4(texelFetch(light, at, 0).rgb, 0.0));
}
