// The unit vector across a unit normal that is nearest to where the surface's chart runs along u. Lengyel 2001, "Computing Tangent Space
// Basis Vectors for an Arbitrary Mesh" (Gram-Schmidt).
vec3 surface_tangent(vec3 along_u, vec3 normal) {
    return normalize(along_u - dot(along_u, normal) * normal);
}
