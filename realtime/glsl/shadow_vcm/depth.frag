#version 430
// Depth alone: as the projection leaves it, or linear along the tile's axis.
#ifdef LINEAR
uniform vec3 eye;
uniform vec3 forward;
uniform float far;
in vec3 position;
void main() { gl_FragDepth = dot(position - eye, forward) / far; }
#else
void main() {}
#endif
