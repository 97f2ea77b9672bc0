// Guides in the world, and hairs between four of them.
struct Guide {
    vec4 points[4];
    vec4 basis[3];  // columns of the matrix that took the guide to the world
};
struct Between {
    uvec4 guides;    // lower left and right, upper left and right in the chart
    vec4 place;      // between left and right, between lower and upper
    vec4 own[3];     // what a hair has of its own, by control points but the first
    vec4 color_radius;
};
layout(std430, binding = 0) readonly buffer Hairs { Between hairs[]; };
layout(std430, binding = 1) buffer Guides { Guide guides[]; };

vec4 guide_weights(vec4 place) {
    vec2 f = place.xy, b = 1.0 - f;
    return vec4(b.x * b.y, f.x * b.y, b.x * f.y, f.x * f.y);
}

// Control point k of a hair, in the world: what four guides make of it there, and its own curl and length in their mean basis.
vec3 point_between(uint hair, int k) {
    vec4 w = guide_weights(hairs[hair].place);
    vec3 made = vec3(0.0), own = k == 0 ? vec3(0.0) : hairs[hair].own[k - 1].xyz;
    for (int i = 0; i < 4; ++i) {
        uint g = hairs[hair].guides[i];
        vec4 basis[3] = guides[g].basis;
        made += w[i] * (guides[g].points[k].xyz + own.x * basis[0].xyz + own.y * basis[1].xyz + own.z * basis[2].xyz);
    }
    return made;
}

vec3 tangent_between(uint hair) {
    vec4 w = guide_weights(hairs[hair].place);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 4; ++i) sum += w[i] * guides[hairs[hair].guides[i]].basis[0].xyz;
    return normalize(sum);
}
