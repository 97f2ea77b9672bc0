#version 430
// NVIDIA 2005, the GeForce 7800 GTX demos: the eye of "Luna", lit in the eye's frame.
#include "eye/uniforms.glsl"
#include "eye/surroundings.glsl"
#include "lib/blinn_phong.glsl"
#include "lib/cornea_talk.glsl"
#include "lib/fresnel.glsl"
#include "lib/wrap.glsl"
layout(binding = 1) uniform sampler2D iris_map;
layout(binding = 2) uniform sampler2D shadow_maps;
uniform float talk_iris_centre;
uniform float talk_iris_radius;
uniform vec3 eye_position;
uniform vec3 sclera_albedo;
uniform vec4 light_places[2];
uniform vec3 light_colors[2];
uniform mat4 shadow_matrices[2];
uniform vec3 shadow_origins[2];
uniform vec3 shadow_axes[2];
in vec3 obj_coord;
in vec3 obj_normal;
layout(location = 0) out vec4 out_color;

const float WRAP = 0.2;
const float SPECULAR_COLOR = 6.0;
const float SPECULAR_EXPONENT = 4000.0;
const float SLACK = 1e-3; // of the depth, for its rounding: nothing that casts a shadow touches the eye

// The four parameters that differ between the white and the iris, and where the light falls.
struct Surface {
    vec3 point;
    vec3 normal;
    vec3 diffuse;
    vec3 specular;
    float exponent;
};

Surface blend(Surface iris, Surface white, float t) {
    return Surface(
        iris.point,
        normalize(t * white.normal + (1.0 - t) * iris.normal),
        t * white.diffuse + (1.0 - t) * iris.diffuse,
        t * white.specular + (1.0 - t) * iris.specular,
        t * white.exponent + (1.0 - t) * iris.exponent);
}

TalkIris traced_iris(vec3 coord, vec3 N, vec3 V) {
    return trace_iris_talk(
        coord, N, V, eyeball.ior, eyeball.sclera_radius, eyeball.limbus_height, talk_iris_centre, talk_iris_radius);
}

// A ray that leaves through the cornea's side sees no iris: black.
Surface iris_surface(vec3 coord, vec3 N, vec3 V, Surface white) {
    TalkIris seen = traced_iris(coord, N, V);
    bool is_pupil = dot(seen.point.xz, seen.point.xz) < eyeball.pupil_radius * eyeball.pupil_radius;
    vec3 color = is_pupil ? vec3(0.0) : textureLod(iris_map, iris_uv(eyeball, seen.point), 0.0).rgb;
    Surface iris = Surface(seen.point, seen.normal, color, vec3(SPECULAR_COLOR), SPECULAR_EXPONENT);
    Surface gone = Surface(coord, N, vec3(0.0), vec3(SPECULAR_COLOR), SPECULAR_EXPONENT);
    return blend(seen.exits ? gone : iris, white, edge_blend(coord.y, eyeball.limbus_height, eyeball.apex));
}

// Shadow coordinates belong to where the light falls: for the iris that is the traced point, not the polygon's.
float visibility(int light, vec3 point) {
#ifdef SHADOWS
    vec3 world = eye_to_world * point + eye_position;
    vec4 clip = shadow_matrices[light] * vec4(world, 1.0);
    int side = textureSize(shadow_maps, 0).y;
    ivec2 texel = clamp(ivec2((0.5 * clip.xy / clip.w + 0.5) * float(side)), 0, side - 1) + ivec2(light * side, 0);
    float depth = dot(world - shadow_origins[light], shadow_axes[light]);
    return depth * (1.0 - SLACK) <= texelFetch(shadow_maps, texel, 0).r ? 1.0 : 0.0;
#else
    return 1.0;
#endif
}

void main() {
    vec3 coord = obj_coord, N = normalize(obj_normal);
    vec3 V = normalize(obj_coord - view_origin);
#ifdef TRUE_SPHERES
    bool is_cornea;
    vec3 x, n;
    if (eye_hit(eyeball, view_origin, V, x, n, is_cornea)) {
        coord = x;
        N = n;
    }
#endif
    bool on_iris = coord.y > eyeball.limbus_height;
#ifdef IRIS_UV
    TalkIris seen = traced_iris(coord, N, V);
    out_color = on_iris && !seen.exits ? vec4(iris_uv(eyeball, seen.point), 0.0, 1.0) : vec4(0.0);
#else
    Surface white = Surface(coord, N, sclera_albedo, vec3(SPECULAR_COLOR), SPECULAR_EXPONENT);
    Surface s = white;
#ifdef BRANCHING
    if (on_iris) s = iris_surface(coord, N, V, white);
#else
    Surface iris = iris_surface(coord, N, V, white);
    s = on_iris ? iris : white;
#endif
    vec3 to_eye = normalize(view_origin - s.point), diffuse = vec3(0.0), specular = vec3(0.0);
    for (int i = 0; i < 2; ++i) {
        vec3 L = normalize(light_places[i].xyz - light_places[i].w * s.point);
        vec3 color = light_colors[i] * visibility(i, s.point);
        diffuse += color * s.diffuse * wrap_diffuse(s.normal, L, WRAP);
        specular += color * s.specular * blinn_phong(s.normal, L, to_eye, s.exponent);
    }
    float F = F_talk(dot(s.normal, -V));
#ifdef WHOLE_EYE
    out_color = vec4((diffuse + specular) * (1.0 - F) + mirrored_radiance(reflect(V, s.normal)) * F, 1.0);
#else
    out_color = on_iris ? vec4(diffuse * (1.0 - F), 1.0) : vec4(0.0);
#endif
#endif
}
