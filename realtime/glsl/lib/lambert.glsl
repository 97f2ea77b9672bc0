const float PI = 3.14159265358979;

// Wallace, Elmquist, Haines 1989, "A Ray Tracing Algorithm for Progressive Radiosity", eq. 2: irradiance at a point per
// unit of radiosity of a small source, taken as a disk of that area. `to_source` is not normalised. The area in the
// denominator keeps the factor below 1 however close the source comes.
float disk_form_factor(vec3 normal, vec3 to_source, vec3 source_normal, float area) {
    float r2 = dot(to_source, to_source);
    float cos_receiver = dot(normal, to_source);
    float cos_source = -dot(source_normal, to_source);
    if (cos_receiver <= 0.0 || cos_source <= 0.0 || r2 <= 0.0) return 0.0;
    return cos_receiver * cos_source / r2 * area / (PI * r2 + area);
}
