#version 430
// The iris in RINGS x SECTORS cells: the mean radiosity of each from the light that comes in, and its mean reflectance.
#include "eye/iris_light.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Radiosity { vec4 radiosity[]; };
layout(std430, binding = 1) writeonly buffer Reflectance { vec4 reflectance[]; };
const int SIDE = 3; // points along each side of a cell

void main() {
    int cell = int(gl_GlobalInvocationID.x);
    if (cell >= RINGS * SECTORS) return;
    vec2 corner = vec2(cell / SECTORS, cell % SECTORS);
    vec3 emitted = vec3(0.0), reflected = vec3(0.0);
    float weight = 0.0;
    for (int i = 0; i < SIDE * SIDE; ++i) {
        vec2 at = corner + (0.5 + vec2(i / SIDE, i % SIDE)) / float(SIDE);
        vec3 normal;
        vec3 p = iris_point(eyeball, at.x / float(RINGS) * eyeball.limbus_radius, at.y / float(SECTORS) * 2.0 * PI, normal);
        float area = at.x / normal.y;
        vec3 rho = iris_reflectance(p);
        emitted += area * rho * iris_irradiance(p, normal);
        reflected += area * rho;
        weight += area;
    }
    radiosity[cell] = vec4(emitted / weight, 0.0);
    reflectance[cell] = vec4(reflected / weight, 0.0);
}
