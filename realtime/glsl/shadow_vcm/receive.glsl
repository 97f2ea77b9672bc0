// A receiver of shadows in a compute shader: what the sensor sees at a sample, and how much of the light that sees.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 0, rgba32f) writeonly uniform image2D visibility;
uniform vec3 light;
uniform float side;  // N: texels along an edge of a tile

float light_seen(vec3 normal, vec3 to_light);

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(visibility)))) return;
    vec4 position = texelFetch(position_map, at, 0);
    vec3 normal = texelFetch(normal_map, at, 0).xyz;
    vec3 to_light = light - position.xyz;
    bool faces_light = position.w > 0.0 && dot(normal, to_light) > 0.0;
    imageStore(visibility, at, vec4(faces_light ? light_seen(normal, to_light) : 0.0));
}
