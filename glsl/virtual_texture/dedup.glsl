// Stage 2 without a geometry shader (paper 1, section 2.2): what a pixel asks for. Needs pyramid.glsl, tile_order.glsl.
layout(binding = 0) uniform usampler2D u1;  // nearest texels, clamped at the edge

// U1's texel as stored; beyond the picture's edge the background.
uvec3 stored_triple(uvec2 pixel) {
    uvec2 last = uvec2(textureSize(u1, 0)) - 1u;
    uvec3 stored = texelFetch(u1, ivec2(min(pixel, last)), 0).xyz;
    return any(greaterThan(pixel, last)) ? uvec3(BACKGROUND) : stored;
}

bool same_triple(uvec3 stored, uvec3 other) { return U1_PACKED == 1 ? stored.x == other.x : stored == other; }

// (q, i, j) in the keying's grid. q = FIRST_RESIDENT_LEVEL or more: the pixel asks for no tile.
uvec3 keyed_triple(uvec3 stored) {
    uvec3 qij = load_triple(uvec4(stored, 0));
    if (NATIVE_KEYING == 1) qij.yz >>= min(qij.x, 31u);
    return qij;
}
