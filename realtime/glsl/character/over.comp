#version 430
// Put a premultiplied layer over what is seen; with AMONG only on surfaces of a kind, and what it does not cover is black.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D layer;
layout(binding = 0, rgba32f) uniform image2D shaded;
#ifdef AMONG
layout(binding = 1) uniform sampler2D around_map;
uniform float kind;
#endif
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(shaded)))) return;
#ifdef AMONG
    if (texelFetch(around_map, at, 0).w != kind) return;
#endif
    vec4 above = texelFetch(layer, at, 0);
    imageStore(shaded, at, vec4(above.rgb + (1.0 - above.a) * imageLoad(shaded, at).rgb, 1.0));
}
