#version 430
// Puts a layer behind those in front of it.
#include "defocus_layers/overlap.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D layer;
layout(binding = 1) uniform sampler2D moment_x;
layout(binding = 2) uniform sampler2D moment_y;
layout(binding = 0, rgba32f) uniform image2D image;
layout(binding = 1, rg32f) uniform image2D covered;  // first moments of the image's alpha
uniform bool last;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(image)))) return;
    vec4 whole = texelFetch(layer, pixel, 0);
    if (whole.a == 0.0) return;
    // The last layer has no holes. In others more than all of the lens is covered where disks of several depths meet.
    float scale = 1.0 / (last ? whole.a : max(1.0, whole.a));
    whole *= scale;
    vec4 x = scale * texelFetch(moment_x, pixel, 0), y = scale * texelFetch(moment_y, pixel, 0);
    vec4 front = imageLoad(image, pixel);
    vec2 m = imageLoad(covered, pixel).xy, behind = vec2(x.a, y.a);
    float left = 1.0 - front.a;
    float alpha = last ? left : min(left, whole.a - overlap(front.a, m, whole.a, behind));
    // To first order over the lens u, with mean 1 and <u_x^2> = 1/4, light with the moments M is c + 4 M.u: what the
    // front leaves of it is the mean of its product with 1 - a - 4 m.u.
    vec4 seen = clamp(whole * left - 4.0 * (m.x * x + m.y * y), vec4(0.0), whole);
    // A sliver says too little about its colour.
    vec3 colour = seen.a > 0.02 * whole.a ? seen.rgb / seen.a : whole.rgb / whole.a;
    front += alpha * vec4(colour, 1.0);
    m += behind * left - m * whole.a;
    m *= min(1.0, largest_moment(front.a) / max(length(m), 1e-6));
    imageStore(image, pixel, front);
    imageStore(covered, pixel, vec4(m, 0.0, 0.0));
}
