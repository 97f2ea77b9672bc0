// How opaque hair is.
#include "hair_light/grid.glsl"
layout(binding = 0) uniform sampler3D across;   // hair's area, then its moments xx, yy, zz, per unit of volume
layout(binding = 1) uniform sampler3D between;  // moments xy, xz, yz

// Area that hair shows to light along `d`, per unit of volume: area times the sine of the angle to the tangent, by the second moments of
// tangents. For tangents that are all the same it is exact, for ones that point everywhere 4 % too much.
float hair_extinction(vec4 a, vec3 b, vec3 d) {
    float along = dot(a.yzw, d * d) + 2.0 * (b.x * d.x * d.y + b.y * d.x * d.z + b.z * d.y * d.z);
    return sqrt(max(a.x * (a.x - along), 0.0));
}
