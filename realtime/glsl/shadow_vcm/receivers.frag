#version 430
// What each sample sees: w of the position is 1 where something was hit.
in vec3 place;
flat in vec3 face_normal;
layout(location = 0) out vec4 out_position;
layout(location = 1) out vec4 out_normal;
void main() {
    out_position = vec4(place, 1.0);
    out_normal = vec4(face_normal, 0.0);
}
