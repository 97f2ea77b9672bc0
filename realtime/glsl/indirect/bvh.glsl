// Does anything of the subject lie between two points? The hierarchy is in depth-first order: a box that is missed names the
// node to go on with. Triangles: Moeller & Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection".
layout(std430, binding = 4) readonly buffer Nodes { vec4 nodes[]; };
layout(std430, binding = 5) readonly buffer Triangles { vec4 triangles[]; };
uniform int node_count;

const float NO_HIT = 3e38;

// Distance to a triangle in units of `direction`, or NO_HIT.
float triangle_distance(int index, vec3 origin, vec3 direction) {
    vec3 edge1 = triangles[3 * index + 1].xyz, edge2 = triangles[3 * index + 2].xyz;
    vec3 p = cross(direction, edge2);
    float determinant = dot(edge1, p);
    if (determinant == 0.0) return NO_HIT;
    vec3 s = (origin - triangles[3 * index].xyz) / determinant;
    float u = dot(s, p);
    vec3 q = cross(s, edge1);
    float v = dot(direction, q), t = dot(edge2, q);
    return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 ? t : NO_HIT;
}

// 1 / direction, large but finite along an axis that the ray does not follow: nothing times infinity would be no number.
vec3 reciprocal(vec3 direction) {
    return 1.0 / mix(direction, vec3(1e-20), equal(direction, vec3(0.0)));
}

// Whether a ray misses a box before `end`.
bool misses_box(vec3 low, vec3 high, vec3 origin, vec3 inverse, float end) {
    vec3 t0 = (low - origin) * inverse, t1 = (high - origin) * inverse;
    vec3 nearest = min(t0, t1), farthest = max(t0, t1);
    float enter = max(max(nearest.x, nearest.y), nearest.z), leave = min(min(farthest.x, farthest.y), farthest.z);
    return leave < 0.0 || enter > leave || enter > end;
}

// Whether the open segment from `origin` to `origin + end * direction` meets a triangle.
bool is_blocked(vec3 origin, vec3 direction, float end) {
    vec3 inverse = reciprocal(direction);
    int node = 0;
    while (node < node_count) {
        vec4 low = nodes[2 * node], high = nodes[2 * node + 1];
        if (misses_box(low.xyz, high.xyz, origin, inverse, end)) {
            node = int(low.w);
            continue;
        }
        if (high.w >= 0.0) {
            int first = int(high.w) / TRIANGLES_A_LEAF, count = int(high.w) % TRIANGLES_A_LEAF + 1;
            for (int i = first; i < first + count; ++i)
                if (triangle_distance(i, origin, direction) < end) return true;
        }
        ++node;
    }
    return false;
}
