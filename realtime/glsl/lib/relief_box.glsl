const float NEVER = 1e30;

// Kay, Kajiya 1986, "Ray Tracing Complex Scenes", section 2.1: where a ray enters and leaves a box, in lengths of d; it
// misses the box if x > y. `entered` is the axis across which it comes in: z if it meets an edge.
vec2 box_span(vec3 o, vec3 d, vec3 low, vec3 high, out int entered) {
    bvec3 still = lessThan(abs(d), vec3(1e-20));  // a box is crossed before a division by less overflows
    bvec3 outside = bvec3(o.x < low.x || o.x > high.x, o.y < low.y || o.y > high.y, o.z < low.z || o.z > high.z);
    vec3 divisor = mix(d, vec3(1.0), still);
    vec3 to_low = (low - o) / divisor, to_high = (high - o) / divisor;
    vec3 begin = mix(min(to_low, to_high), mix(vec3(-NEVER), vec3(NEVER), outside), still);
    vec3 end = mix(max(to_low, to_high), mix(vec3(NEVER), vec3(-NEVER), outside), still);
    entered = begin.z >= max(begin.x, begin.y) ? 2 : begin.x > begin.y ? 0 : 1;
    return vec2(max(begin.x, max(begin.y, begin.z)), min(end.x, min(end.y, end.z)));
}
