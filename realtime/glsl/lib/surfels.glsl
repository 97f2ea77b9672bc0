// A piece of what a cube map sees. Surfaces have an area and a place; the sky (area 0) has only a direction.
struct Surfel {
    vec4 position_area;       // sky: the unit direction, 0
    vec4 normal_solid_angle;  // the solid angle is the one seen from the cube's centre
    vec4 albedo;
};
