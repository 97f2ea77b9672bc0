// Direction to the latitude-longitude image of a scene's environment, which has `rows` rows: the centre of the first is +Y, that
// of the last -Y; the middle column is -Z.
vec2 sky_uv(vec3 d, float rows) {
    const float pi = 3.14159265358979;
    float down = acos(clamp(d.y / length(d), -1.0, 1.0)) / pi;
    float around = d.x == 0.0 && d.z == 0.0 ? 0.0 : atan(d.x, -d.z);  // straight up and down every angle is right
    return vec2(0.5 + around / (2.0 * pi), (0.5 + down * (rows - 1.0)) / rows);
}
