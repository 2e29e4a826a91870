// Step D of paper 3: a table in place of the Gaussian. Needs weights.glsl and the macro MAP_BINDING.
layout(constant_id = 60) const uint MAP = 0;  // 0: none; else 1 + the index of the `MapShape` variant
layout(constant_id = 61) const uint MAP_ENTRIES = 1;
layout(constant_id = 62) const uint MAP_BITS = 8;
layout(constant_id = 63) const uint MAP_LINEAR = 0;  // 1: interpolates the two nearest entries
layout(constant_id = 64) const float MAP_REACH = 1.0;  // the largest r of the map
layout(binding = MAP_BINDING) uniform utextureBuffer weight_map;

float map_entry(uint n) {
    uint bit = n * MAP_BITS;
    uint bits = texelFetch(weight_map, int(bit >> 5)).r >> (bit & 31u);
    uint most = (1u << MAP_BITS) - 1u;
    return float(bits & most) / float(most);
}

uint map_place(float part) {
    return min(uint(max(part, 0.0) * float(MAP_ENTRIES)), MAP_ENTRIES - 1u);
}

float along_map(float part) {
    if (MAP_LINEAR == 0) return map_entry(map_place(part));
    float at = clamp(part * float(MAP_ENTRIES) - 0.5, 0.0, float(MAP_ENTRIES - 1u));
    uint n = uint(at);
    return mix(map_entry(n), map_entry(min(n + 1u, MAP_ENTRIES - 1u)), at - float(n));
}

// The weight at a position in the unit disc.
float weight(vec2 at) {
    if (MAP == 0) return gaussian(at);
    float square = dot(at, at) / (MAP_REACH * MAP_REACH);
    at /= MAP_REACH;
    if (MAP == 1) return map_entry(map_place(0.5 * at.y + 0.5) * MAP_ENTRIES + map_place(0.5 * at.x + 0.5));
    if (MAP == 2) return map_entry(map_place(abs(at.y)) * MAP_ENTRIES + map_place(abs(at.x)));
    return along_map(MAP == 3 ? sqrt(square) : square);
}
