// For each hair of the scene, as realtime/fibre.py lays it out: four lobes over azimuth and inclination; albedo; all that is sent;
// constants.
layout(binding = 4) uniform sampler2DArray fibre_table;

const int ALBEDO = 4;
const int ALL = 5;
const int LAYERS = 7;

// Of a lobe: variance, sine and cosine of its tilt. Then after Kajiya & Kay: diffuse colour; glossy colour and exponent.
const int KAJIYA_DIFFUSE = 4;
const int KAJIYA_GLOSSY = 5;

vec4 fibre_constant(int hair, int which) {
    return texelFetch(fibre_table, ivec3(which, 0, LAYERS * hair + LAYERS - 1), 0);
}
