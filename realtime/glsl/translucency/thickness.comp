#version 430
// Signed sums to thickness, one invocation a pixel; counts the pixels that see the subject, and those where its faces do not
// pair up. A missing front face counts as one at the camera, which is right where the camera is inside the body.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D signed_sum;
layout(binding = 0, r32f) writeonly uniform image2D thickness;
layout(std430, binding = 0) buffer Counts { uint seen; uint unpaired; };
uniform float centre_distance;
uniform int grid;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel * grid, imageSize(thickness)))) return;
    bool is_seen = false, is_unpaired = false;
    for (int i = 0; i < grid * grid; ++i) {
        ivec2 at = pixel * grid + ivec2(i % grid, i / grid);
        vec2 sum_count = texelFetch(signed_sum, at, 0).xy;
        is_seen = is_seen || sum_count != vec2(0.0);
        is_unpaired = is_unpaired || sum_count.y != 0.0;
        imageStore(thickness, at, vec4(max(sum_count.x + centre_distance * sum_count.y, 0.0)));
    }
    if (is_seen) atomicAdd(seen, 1u);
    if (is_unpaired) atomicAdd(unpaired, 1u);
}
