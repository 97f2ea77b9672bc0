// lights[0 .. light_count - 1]: all emitters but the sky. direct_irradiance(position, normal): from all of them, with shadows.
#include "indirect/direct_light.glsl"
