// The nearest triangle of the subject along a ray.
#include "indirect/bvh.glsl"

struct Hit {
    int triangle;  // -1: none
    float distance;
};

Hit first_hit(vec3 origin, vec3 direction) {
    vec3 inverse = reciprocal(direction);
    Hit hit = Hit(-1, NO_HIT);
    int node = 0;
    while (node < node_count) {
        vec4 low = nodes[2 * node], high = nodes[2 * node + 1];
        if (misses_box(low.xyz, high.xyz, origin, inverse, hit.distance)) {
            node = int(low.w);
            continue;
        }
        if (high.w >= 0.0) {
            int first = int(high.w) / TRIANGLES_A_LEAF, count = int(high.w) % TRIANGLES_A_LEAF + 1;
            for (int i = first; i < first + count; ++i) {
                float t = triangle_distance(i, origin, direction);
                if (t < hit.distance) hit = Hit(i, t);
            }
        }
        ++node;
    }
    return hit;
}
