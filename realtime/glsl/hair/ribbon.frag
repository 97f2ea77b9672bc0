#version 430
// Premultiplied: blended by (1, 1 - alpha), what is behind shines through, and alpha ends as the part that hair covers.
#include "lib/ribbon.glsl"
noperspective in float away;
noperspective in float width;
noperspective in float from_root;
noperspective in float to_tip;
noperspective in float shift;
in float rise;
in vec3 radiance;
flat in vec2 depth_of;
layout(location = 0) out vec4 color;
void main() {
    float height = height_of_tube(away, width);
    float opacity = ribbon_coverage(away, width) * within_ends(from_root - height * shift, to_tip + height * shift);
    color = vec4(opacity * radiance, opacity);
    gl_FragDepth = depth_of.x + depth_of.y / (1.0 / gl_FragCoord.w - height * rise);
}
