#version 430
// Gives the fragments of each triangle its own normal, on the side from which its corners run counter-clockwise.
layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;
in vec3 position[];
out vec3 place;
flat out vec3 face_normal;
void main() {
    vec3 across = cross(position[1] - position[0], position[2] - position[0]);
    if (dot(across, across) == 0.0) return;  // without area it covers nothing, and has no normal
    vec3 n = normalize(across);
    for (int i = 0; i < 3; ++i) {
        gl_Position = gl_in[i].gl_Position;
        place = position[i];
        face_normal = n;
        EmitVertex();
    }
    EndPrimitive();
}
