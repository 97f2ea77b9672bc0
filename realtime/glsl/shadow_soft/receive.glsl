// Adds what each receiver sees of a light, or of a part of it, from the distances around a point: six faces side by side.
#include "lib/ball.glsl"
#include "lib/cube.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D distances;
layout(binding = 0, rgba32f) uniform image2D visibility;
uniform vec3 centre;
uniform float share;  // of the whole light

// A texel of slack, which is as far as a comparison reaches: where the receiver meets another surface, that one is nearer.
const float SLACK_TEXELS = 1.0;

struct Receiver {
    vec3 v;  // from the centre of the distances
    vec3 normal;
    float distance;
    float texel;  // size of a texel at that distance
};

// What is seen of the light, the horizon of the receiver left out; `pixel` may be used to vary the taps.
float seen_part(Receiver r, float height, ivec2 pixel);

float distance_at(int face, ivec2 texel) {
    return texelFetch(distances, texel + ivec2(face * textureSize(distances, 0).y, 0), 0).r;
}

float distance_along(vec3 direction) {
    int side = textureSize(distances, 0).y;
    vec2 st;
    int face = cube_face(direction, st);
    return distance_at(face, min(ivec2((0.5 * st + 0.5) * float(side)), ivec2(side - 1)));
}

// Beyond this part of the distance the receiver's plane does not tell what is near the receiver: seen edge on, it would pass
// between the light and what hides it.
const float NEAR_RECEIVER = 0.8;

// The map is compared with the distance that the receiver's own plane has in the direction of the texel, so that a flat
// receiver never shades itself.
bool is_lit(Receiver r, int face, ivec2 texel, float side) {
    vec3 u = normalize(cube_direction(face, (vec2(texel) + 0.5) / side * 2.0 - 1.0));
    float facing = dot(r.normal, u);
    float plane = facing < 0.0 ? dot(r.normal, r.v) / facing : r.distance;
    float slack = SLACK_TEXELS * r.texel;
    float seen = distance_at(face, texel);
    bool is_own_plane = abs(seen - plane) <= slack * seen / r.distance;
    return is_own_plane || seen >= clamp(plane, NEAR_RECEIVER * r.distance, r.distance) - slack;
}

// Reeves, Salesin, Cook 1987, "Rendering Antialiased Shadows with Depth Maps": the mean of comparisons, not of distances. At
// the edge of a face its own outermost texels stand for those beyond.
float lit_part(Receiver r, vec3 direction) {
    int side = textureSize(distances, 0).y;
    vec2 st;
    int face = cube_face(direction, st);
    vec2 at = (0.5 * st + 0.5) * float(side) - 0.5;
    ivec2 low = ivec2(floor(at));
    vec2 f = at - vec2(low);
    float sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 corner = ivec2(k & 1, k >> 1);
        vec2 weight = mix(1.0 - f, f, vec2(corner));
        ivec2 texel = clamp(low + corner, ivec2(0), ivec2(side - 1));
        if (is_lit(r, face, texel, float(side))) sum += weight.x * weight.y;
    }
    return sum;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(visibility)))) return;
    vec4 position = texelFetch(position_map, pixel, 0);
    if (position.w == 0.0) return;
    vec3 normal = texelFetch(normal_map, pixel, 0).xyz;
    vec3 v = position.xyz - centre;
    float distance = length(v);
    Receiver r = Receiver(v, normal, distance, 2.0 * distance / float(textureSize(distances, 0).y));
    float seen = seen_part(r, -dot(normal, v), pixel);
    imageStore(visibility, pixel, imageLoad(visibility, pixel) + vec4(share * seen));
}
