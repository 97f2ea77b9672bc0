// The six faces of a cube map side by side in one texture: face f holds columns f * side .. (f + 1) * side - 1.
// OpenGL 4.6 specification, table 8.19: st in [-1, 1] across a face, rows along +t.

vec3 cube_direction(int face, vec2 st) {
    switch (face) {
        case 0: return vec3(1.0, -st.y, -st.x);
        case 1: return vec3(-1.0, -st.y, st.x);
        case 2: return vec3(st.x, 1.0, st.y);
        case 3: return vec3(st.x, -1.0, -st.y);
        case 4: return vec3(st.x, -st.y, 1.0);
        default: return vec3(-st.x, -st.y, -1.0);
    }
}

int cube_face(vec3 d, out vec2 st) {
    vec3 a = abs(d);
    if (a.x >= a.y && a.x >= a.z) {
        st = vec2(d.x > 0.0 ? -d.z : d.z, -d.y) / a.x;
        return d.x > 0.0 ? 0 : 1;
    }
    if (a.y >= a.z) {
        st = vec2(d.x, d.y > 0.0 ? d.z : -d.z) / a.y;
        return d.y > 0.0 ? 2 : 3;
    }
    st = vec2(d.z > 0.0 ? d.x : -d.x, -d.y) / a.z;
    return d.z > 0.0 ? 4 : 5;
}

// Solid angle of a texel, by the midpoint rule: side^2 texels a face.
float cube_texel_solid_angle(vec2 st, float side) {
    float r2 = 1.0 + dot(st, st);
    return 4.0 / (side * side * r2 * sqrt(r2));
}
