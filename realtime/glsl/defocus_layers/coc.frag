#version 430
// Signed circle of confusion [px] of each sample, from its linear planar depth z: K (1 / z_f - 1 / z). Potmesil &
// Chakravarty 1982, "Synthetic Image Generation with a Lens and Aperture Camera Model", section 2.
uniform vec3 eye;
uniform vec3 forward;
uniform float coc_scale;
uniform float inverse_focus;
uniform float largest;  // disks beyond this radius cover the image anyway
uniform bool outside_only;
in vec3 position;
layout(location = 0) out float coc;
void main() {
    if (outside_only && !gl_FrontFacing) discard;
    coc = clamp(coc_scale * (inverse_focus - 1.0 / dot(position - eye, forward)), -largest, largest);
}
