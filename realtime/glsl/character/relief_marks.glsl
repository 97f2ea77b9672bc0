// What character/marks.frag writes of a mesh, for rays that meet a relief at a place of its grid. Light from all around is
// interpolated between the vertices of its mesh, in the order in which scenes/relief.py lists them.
layout(binding = 3, rgba32f) writeonly uniform image2D around_marks;
layout(binding = 4, rgba32f) writeonly uniform image2D emitted_marks;
layout(binding = 5, rgba32f) writeonly uniform image2D whole_marks;
uniform sampler2D emission_map;
uniform vec3 emission;
uniform float kind;
uniform vec3 on_the_whole;

#ifdef RECEIVED
layout(std430, binding = 0) readonly buffer Received { vec4 received[]; };

// Three by three vertices for each cell.
vec3 received_on_top(vec2 place) {
    ivec2 cell = cell_at(place);
    vec2 at = 2.0 * (place - vec2(cell));
    ivec2 quarter = clamp(ivec2(at), ivec2(0), ivec2(1));
    int first = 9 * (cell.y * cells.x + cell.x) + 3 * quarter.y + quarter.x;
    vec2 part = at - vec2(quarter);
    vec3 low = mix(received[first].rgb, received[first + 1].rgb, part.x);
    return mix(low, mix(received[first + 3].rgb, received[first + 4].rgb, part.x), part.y);
}

// The border's vertices counter-clockwise from the origin, corners twice; then those at its feet.
vec3 received_on_wall(vec3 place, vec3 n) {
    ivec2 count = 2 * cells + 1;
    bool is_along_x = n.y != 0.0;
    float at = 2.0 * (is_along_x ? place.x : place.y), last = float((is_along_x ? count.x : count.y) - 1);
    if (n.y > 0.0 || n.x < 0.0) at = last - at;
    int side = n.y < 0.0 ? 0 : n.x > 0.0 ? count.x : n.y > 0.0 ? count.x + count.y : 2 * count.x + count.y;
    float begin = clamp(floor(at), 0.0, last - 1.0);
    int top = 9 * cells.x * cells.y + side + int(begin), foot = top + 2 * (count.x + count.y);
    vec3 below = mix(received[foot].rgb, received[foot + 1].rgb, at - begin);
    vec3 above = mix(received[top].rgb, received[top + 1].rgb, at - begin);
    return mix(below, above, place.z / max(height_at(place.xy), 1e-6));  // a wall that is no higher is not met
}
#endif

void mark_relief(ivec2 at, vec3 place, vec3 n) {
    vec3 around = vec3(0.0);
#ifdef RECEIVED
    around = n.z == 0.0 ? received_on_wall(place, n) : received_on_top(place.xy);
#endif
    vec2 uv = place.xy / vec2(cells);
    imageStore(around_marks, at, vec4(around, kind));
    vec3 emitted = emission * textureLod(emission_map, uv, 0.0).rgb;
    imageStore(emitted_marks, at, kind >= FIRST_COAT ? vec4(uv, 0.0, 0.0) : vec4(emitted, 0.0));
    imageStore(whole_marks, at, vec4(on_the_whole, 1.0));
}
