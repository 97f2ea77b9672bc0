// Where a ray first meets the relief, by a quadtree of highest heights. Everything is in the relief's grid: x and y count
// samples, z is the height. Drobot 2009, "Quadtree Displacement Mapping with Height Blending"; Tevs, Ihrke, Seidel 2008,
// "Maximum Mipmaps for Fast, Accurate, and Scalable Dynamic Height Field Rendering".
#include "lib/relief_box.glsl"
#include "lib/relief_patch.glsl"
layout(binding = 1) uniform sampler2D heights;  // the samples
layout(binding = 2) uniform sampler2D highest;  // level 0: the highest corner of each cell; then of 2 x 2 cells, and so on
uniform ivec2 cells;
uniform float top;
uniform int levels;

vec4 cell_corners(ivec2 cell) {
    return vec4(
        texelFetch(heights, cell, 0).r,
        texelFetch(heights, cell + ivec2(1, 0), 0).r,
        texelFetch(heights, cell + ivec2(0, 1), 0).r,
        texelFetch(heights, cell + ivec2(1, 1), 0).r);
}

ivec2 cell_at(vec2 place) {
    return clamp(ivec2(floor(place)), ivec2(0), cells - 1);
}

float height_at(vec2 place) {
    ivec2 cell = cell_at(place);
    return patch_height(cell_corners(cell), place - vec2(cell));
}

// Where a ray is in the field's box, which ends far below the lowest height: a ray that comes so far has met the surface.
vec2 field_span(vec3 o, vec3 d, out int entered) {
    return box_span(o, d, vec3(0.0, 0.0, -1.0), vec3(cells, top), entered);
}

// The first place at which the ray o + t d is not above the field, for t within `span`, which lies in the field's box.
// Nodes are tracked by whole numbers, so that rounding skips none: a place off its node by rounding belongs to it.
bool field_hit(vec3 o, vec3 d, vec2 span, out vec3 place, out ivec2 cell) {
    ivec2 ahead = ivec2(greaterThan(d.xy, vec2(0.0))), onward = 2 * ahead - 1, node = ivec2(0);
    bvec2 still = lessThan(abs(d.xy), vec2(1e-20));
    vec2 inverse = 1.0 / mix(d.xy, vec2(1.0), still);
    int level = levels, most = 8 * (cells.x + cells.y + levels) + 8;  // far more nodes than a ray can meet
    float t = span.x;
    for (int i = 0; i < most; ++i) {
        vec2 border = mix((vec2((node + ahead) << level) - o.xy) * inverse, vec2(NEVER), still);
        float end = min(min(border.x, border.y), span.y);
        float bound = texelFetch(highest, node, level).r;
        if (o.z + (d.z < 0.0 ? max(end, t) : t) * d.z <= bound) {
            if (d.z < 0.0) t = max(t, (bound - o.z) / d.z);
            if (level > 0) {
                --level;
                node = clamp(cell_at(o.xy + t * d.xy) >> level, 2 * node, 2 * node + 1);
                continue;
            }
            vec3 begin = o + t * d - vec3(node, 0.0);
            float s = patch_hit(cell_corners(node), begin, d);
            if (t + s <= max(end, t)) {
                place = begin + s * d + vec3(node, 0.0);
                cell = node;
                return true;
            }
        }
        if (end >= span.y) return false;
        t = max(t, end);
        ivec2 above = node >> 1;
        if (border.x <= border.y) node.x += onward.x;
        else node.y += onward.y;
        if (any(lessThan(node, ivec2(0))) || any(greaterThanEqual(node << level, cells))) return false;
        if (node >> 1 != above) {
            ++level;
            node >>= 1;
        }
    }
    return false;
}

// As above, for the carved block with its walls: `from` is where the ray begins. `normal` is not normalised.
bool relief_hit(vec3 o, vec3 d, float from, out vec3 place, out vec3 normal) {
    int entered;
    vec2 span = field_span(o, d, entered);
    bool comes_in = span.x > from;
    span.x = max(span.x, from);
    if (span.x > span.y) return false;
    vec3 begin = o + span.x * d;
    if (comes_in && entered == 2 ? d.z > 0.0 : begin.z < 0.0) return false;  // from below, where the block is open
    if (comes_in && entered < 2) {
        begin[entered] = d[entered] > 0.0 ? 0.0 : float(cells[entered]);
        if (begin.z <= height_at(begin.xy)) {
            place = begin;
            normal = vec3(0.0);
            normal[entered] = -sign(d[entered]);
            return true;
        }
    }
    ivec2 cell;
    if (!field_hit(o, d, span, place, cell)) return false;
    normal = vec3(-patch_slope(cell_corners(cell), place.xy - vec2(cell)), 1.0);
    return true;
}
