#version 430
// Where the subject is.
layout(location = 0) out float covered;
void main() {
    covered = 1.0;
}
