// B, C and D: what a texel weighs.
layout(constant_id = 20) const float ALPHA = 3.125;
layout(constant_id = 21) const uint EDGE = 0;  // the order of `Edge`
layout(constant_id = 22) const uint MAP = 0;  // 0: none, else 1 + the order of `Shape`
layout(constant_id = 23) const uint MAP_ENTRIES = 1;
layout(constant_id = 24) const uint MAP_BITS = 8;
layout(constant_id = 26) const uint MAP_LINEAR = 0;  // between the two nearest entries
layout(constant_id = 25) const float MAP_REACH = 1.0;  // the largest r of the map
layout(binding = 1) uniform utextureBuffer weight_map;

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

// At a place of the unit disc.
float weight(vec2 at) {
    float square = dot(at, at);
    if (MAP == 0) return ALPHA == 0.0 ? 1.0 : exp(-ALPHA * square);
    at /= MAP_REACH;
    square /= MAP_REACH * MAP_REACH;
    if (MAP == 1) return map_entry(map_place(0.5 * at.y + 0.5) * MAP_ENTRIES + map_place(0.5 * at.x + 0.5));
    if (MAP == 2) return map_entry(map_place(abs(at.y)) * MAP_ENTRIES + map_place(abs(at.x)));
    return along_map(MAP == 3 ? sqrt(square) : square);
}

// Of a positive number; at most 1.5e-7 off (Abramowitz and Stegun, "Handbook of mathematical functions", 7.1.26).
float erf_of(float x) {
    float t = 1.0 / (1.0 + 0.3275911 * x);
    float sum = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
    return 1.0 - sum * exp(-x * x);
}

// C: the part of a texel that the edge keeps, by its signed distance in texels.
float kept(float signed_distance) {
    if (EDGE == 0) return signed_distance >= 0.0 ? 1.0 : 0.0;
    float d = abs(signed_distance);
    float inside;
    if (EDGE == 1) inside = 0.5 + 0.5 * erf_of(min(d, 2.0) * 3.5355339);  // 1 / (0.2 sqrt 2)
    else if (d >= 0.5) inside = 1.0;
    else if (EDGE == 2) inside = 0.5 + d * (2.151 - 2.358 * d);
    else if (EDGE == 3) inside = 0.496 + d * (2.288 + d * (-3.074 + 0.956 * d));
    else if (EDGE == 4) inside = d < 0.165 ? 0.506 + 1.79 * d : d < 0.305 ? 0.636 + 1.008 * d : 0.853 + 0.295 * d;
    else inside = 0.5 + d;
    if (signed_distance >= 0.0) return inside;
    return d < 0.5 ? 1.0 - inside : 0.0;
}
