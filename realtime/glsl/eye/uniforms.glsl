// The eye, and the sensor as seen from it: everything is in the eye's frame, in the scene's unit of length.
#include "lib/eye.glsl"
uniform Eye eyeball;
uniform vec3 view_origin;
uniform mat3 eye_to_world;
