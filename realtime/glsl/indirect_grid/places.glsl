// Where the probes are: in the middles of the cells of a box that is cut `per_side` times along each axis.
uniform vec3 box_low;
uniform vec3 box_high;
uniform int per_side;

vec3 probe_place(int probe) {
    ivec3 at = ivec3(probe % per_side, probe / per_side % per_side, probe / (per_side * per_side));
    return mix(box_low, box_high, (vec3(at) + 0.5) / float(per_side));
}
