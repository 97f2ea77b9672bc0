#version 430
// Normals of the deformed surface: those of the faces around each vertex, weighted by their angle there. Thurmer and Wuthrich 1998,
// "Computing Vertex Normals from Polygonal Facets".
layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Positions { vec4 positions[]; };
layout(std430, binding = 2) writeonly buffer Normals { vec4 normals[]; };
layout(std430, binding = 3) readonly buffer Starts { uint starts[]; };    // of each vertex in `corners`, one more at the end
layout(std430, binding = 4) readonly buffer Corners { uvec4 corners[]; };  // of the faces around it, itself first
uniform int count;
void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) return;
    vec3 sum = vec3(0.0);
    for (uint k = starts[i]; k < starts[i + 1]; ++k) {
        vec3 here = positions[corners[k].x].xyz;
        vec3 e = positions[corners[k].y].xyz - here, f = positions[corners[k].z].xyz - here;
        vec3 face = cross(e, f);
        float twice_area = length(face);
        if (twice_area > 0.0) sum += atan(twice_area, dot(e, f)) / twice_area * face;
    }
    normals[i] = vec4(normalize(sum), 0.0);
}
