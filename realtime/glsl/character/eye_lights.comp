#version 430
// How much of each light reaches an eye past other things: the mean over places on it, by which the light counts there.
#include "indirect/direct_light.glsl"
#include "lib/light_place.glsl"
#include "character/places.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer OfTheEye { Light of_the_eye[]; };  // the same lights in the eye's frame

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= light_count) return;
    float seen = 0.0, facing = 0.0;
    for (int k = 0; k < place_count; ++k) {
        vec3 normal = places[k].normal.xyz;
        if (dot(normal, light_place(lights[i]).xyz - light_place(lights[i]).w * places[k].position.xyz) <= 0.0) continue;
        seen += light_visibility(i, places[k].position.xyz, normal);
        facing += 1.0;
    }
    of_the_eye[i].strength.rgb *= seen / max(facing, 1.0);
}
