// What the passes before have found at each sample: texture units 0 to 2 as raster/gbuffer.frag writes them, 4 as
// character/marks.frag does.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D position_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D albedo_map;
layout(binding = 4) uniform sampler2D around_map;
layout(binding = 0, rgba32f) uniform image2D shaded;
uniform vec3 eye;

// Kinds are those of realtime/character_parts.py.
bool is_kind(ivec2 at, float kind) {
    return texelFetch(around_map, at, 0).w == kind;
}
