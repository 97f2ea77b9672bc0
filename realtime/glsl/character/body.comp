#version 430
// Put a body over what is seen through it.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D body;
layout(binding = 1) uniform sampler2D passed;
layout(binding = 0, rgba32f) uniform image2D shaded;
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(shaded)))) return;
    vec3 behind = imageLoad(shaded, at).rgb * texelFetch(passed, at, 0).rgb;
    imageStore(shaded, at, vec4(behind + texelFetch(body, at, 0).rgb, 1.0));
}
