// Stage 2 without a geometry shader (paper 1, section 2.2): a pixel's triple. Needs pyramid.glsl, tile_order.glsl.
layout(binding = 0) uniform usampler2D requests;  // nearest filter, clamped at the edges

// The request image's texel as stored. Pixels beyond the picture's edge are background.
uvec3 stored_triple(uvec2 pixel) {
    uvec2 last = uvec2(textureSize(requests, 0)) - 1u;
    uvec3 stored = texelFetch(requests, ivec2(min(pixel, last)), 0).xyz;
    return any(greaterThan(pixel, last)) ? uvec3(BACKGROUND) : stored;
}

bool same_triple(uvec3 stored, uvec3 other) { return REQUESTS_PACKED == 1 ? stored.x == other.x : stored == other; }

// (q, i, j), with row and column in the grid of tile addresses: the grid of level q if OWN_LEVEL is 1, otherwise the
// grid of level 0. A pixel with q >= FIRST_RESIDENT_LEVEL needs no tile.
uvec3 addressed_triple(uvec3 stored) {
    uvec3 qij = load_triple(uvec4(stored, 0));
    if (OWN_LEVEL == 1) qij.yz >>= min(qij.x, 31u);
    return qij;
}
