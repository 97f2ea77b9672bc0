// NVIDIA 2005, the GeForce 7800 GTX demos, "Ray tracing overview", steps 3 to 6, and the blend at the iris' edge.
#include "lib/refract.glsl"
#include "lib/sphere.glsl"

struct TalkIris {
    vec3 point;
    vec3 normal;
    bool exits; // the ray left the eye through the cornea's side
};

// `sphere_radius`: of the eyeball about the origin. `limbus_height`: 0.805 of a unit sphere. The iris lies on the far side of a
// sphere about (0, iris_centre, 0) through its rim, so that it is always met at t2; its normal looks back at the cornea.
TalkIris trace_iris_talk(
    vec3 coord, vec3 normal, vec3 ray, float ior, float sphere_radius, float limbus_height, float iris_centre, float iris_radius
) {
    vec3 bent = refract_talk(ray, normal, 1.0 / ior);
    TalkIris made;
    made.exits = false;
#ifdef EXIT_BRANCH
    vec3 back = coord + SphereIntersect(sphere_radius * sphere_radius, coord, bent) * bent;
    made.exits = back.y > limbus_height;
#endif
    vec3 centre = vec3(0.0, iris_centre, 0.0);
    vec3 relative = coord - centre;
    relative += SphereIntersect(iris_radius * iris_radius, relative, bent) * bent;
    made.point = centre + relative;
    made.normal = -normalize(relative);
    return made;
}

// How much of the white there is: 0 at the apex, 1 at the edge of the iris, to the sixth power so that the blend keeps to it.
float edge_blend(float height, float limbus_height, float apex) {
    float t = 1.0 - (height - limbus_height) / (apex - limbus_height);
    return pow(clamp(t, 0.0, 1.0), 6.0);
}
