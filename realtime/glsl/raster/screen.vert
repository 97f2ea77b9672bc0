#version 430
// One triangle that covers the viewport; st runs from -1 to 1 across it.
out vec2 st;
void main() {
    st = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(st, 0.0, 1.0);
}
