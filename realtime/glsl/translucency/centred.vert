#version 430
// Vertices seen from the subject's centre, so that what is left of float32 goes into the subject.
uniform mat4 centred_to_clip;
uniform vec3 centre;
in vec3 in_position;
in vec3 in_normal;
out vec3 from_centre;
flat out vec3 corner;
out vec3 normal;
void main() {
    from_centre = in_position - centre;
    corner = from_centre;
    normal = in_normal;
    gl_Position = centred_to_clip * vec4(from_centre, 1.0);
}
