// Direction to the latitude-longitude image of a scene's environment: its first row is +Y, its middle column -Z.
vec2 sky_uv(vec3 d) {
    const float pi = 3.14159265358979;
    return vec2(0.5 + atan(d.x, -d.z) / (2.0 * pi), acos(clamp(d.y / length(d), -1.0, 1.0)) / pi);
}
