// What transport needs to know of a cell.
struct Cell {
    vec4 hair;         // its area per unit of volume; the nearest of TANGENTS directions; which hair of the scene; part of others
    vec4 tangent;      // mean of its tangents, a unit vector
    vec4 skin;         // mean normal of the surface in the cell, its area
    vec4 reflectance;  // of that surface
    vec4 irradiance;   // on it, of light that comes straight from the lights
    vec4 radiance;     // which it reflects
};
layout(std430, binding = 6) buffer Rows { Cell rows[]; };
