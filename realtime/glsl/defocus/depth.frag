#version 430
// Depth alone.
void main() {}
