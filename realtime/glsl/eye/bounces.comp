#version 430
// Light that goes back and forth between iris and cornea, cell by cell: Cohen, Greenberg 1985, "The Hemi-Cube: A Radiosity
// Solution for Complex Environments", eq. 3, by Jacobi iteration. exchange[k, j, a] is the part of the irradiance of ring k
// that ring j gives per unit of radiosity, a sectors away: the same all round the axis.
layout(local_size_x = CELLS) in;
layout(std430, binding = 0) readonly buffer Radiosity { vec4 radiosity[]; };
layout(std430, binding = 1) readonly buffer Reflectance { vec4 reflectance[]; };
layout(std430, binding = 2) readonly buffer Exchange { float exchange[]; };
layout(binding = 0, rgba32f) writeonly uniform image2D returned;
shared vec3 leaving[CELLS];

void main() {
    int cell = int(gl_LocalInvocationIndex);
    int ring = cell / SECTORS, sector = cell % SECTORS;
    leaving[cell] = radiosity[cell].rgb;
    vec3 received = vec3(0.0);
    for (int bounce = 0; bounce < BOUNCES; ++bounce) {
        barrier();
        received = vec3(0.0);
        for (int j = 0; j < CELLS; ++j) {
            int away = (j % SECTORS - sector + SECTORS) % SECTORS;
            received += exchange[(ring * RINGS + j / SECTORS) * SECTORS + away] * leaving[j];
        }
        barrier();
        leaving[cell] = radiosity[cell].rgb + reflectance[cell].rgb * received;
    }
    imageStore(returned, ivec2(sector, ring), vec4(received, 1.0));
}
