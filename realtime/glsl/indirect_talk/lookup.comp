#version 430
// The talk's lookup: neither the relative position nor the sample vector is normalised.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D albedo_map;
layout(binding = 3) uniform samplerCube blurred;
layout(binding = 0, rgba32f) writeonly uniform image2D shaded;
uniform vec3 centre;
uniform float c;
uniform float scale;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(shaded)))) return;
    vec4 normal = texelFetch(normal_map, pixel, 0);
    vec3 env_diffuse = vec3(0.0);
#ifdef CAPTURED
    vec3 sample_vec = normal.xyz + c * (texelFetch(position_map, pixel, 0).xyz - centre);
    env_diffuse = scale * textureLod(blurred, sample_vec, 0.0).rgb;
#endif
    imageStore(shaded, pixel, vec4(normal.w * texelFetch(albedo_map, pixel, 0).rgb * env_diffuse, normal.w));
}
