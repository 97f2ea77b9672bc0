// Coordinates of the table that realtime/slab.py bakes: rows by the cosine of the light's direction to the slab's normal, columns
// by the logarithm of the thickness. The table holds logarithms, which filtering keeps smooth.

// Texture coordinates for PER_OCTAVE columns to a doubling of the thickness; `size` is that of the table.
vec2 slab_table_uv(float thickness, float cosine, float thinnest, vec2 size) {
    float column = clamp(float(PER_OCTAVE) * log2(max(thickness / thinnest, 1.0)), 0.0, size.x - 1.0);
    float row = clamp(cosine, 0.0, 1.0) * (size.y - 1.0);
    return (vec2(column, row) + 0.5) / size;
}

// An entry as radiance per unit of irradiance across the beam. Slabs thinner than the table scatter once, in proportion.
vec3 slab_table_radiance(vec3 entry, float thickness, float cosine, float thinnest) {
    return exp(entry) * cosine * clamp(thickness / thinnest, 0.0, 1.0);
}
