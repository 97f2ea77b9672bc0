// A corner of the unit cube, whose six faces are two triangles each, counter-clockwise from outside. Face 2 a + 1 is across
// the axis a at 1, face 2 a at 0.
vec3 box_corner(int vertex, out int face) {
    face = vertex / 6;
    int axis = face >> 1, side = face & 1, corner = int[](0, 1, 2, 2, 1, 3)[vertex % 6];
    vec3 place = vec3(0.0);
    place[axis] = float(side);
    place[(axis + 1) % 3] = float((side == 1 ? corner : corner >> 1) & 1);
    place[(axis + 2) % 3] = float((side == 1 ? corner >> 1 : corner) & 1);
    return place;
}
