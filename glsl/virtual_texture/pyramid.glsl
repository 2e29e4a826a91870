// The texture pyramid, with the letters of paper 1, section 2: level 0 has 2^m x 2^n texels, a tile 2^k x 2^k.
layout(constant_id = 0) const uint WIDTH_LOG2 = 18;           // m
layout(constant_id = 1) const uint HEIGHT_LOG2 = 17;          // n
layout(constant_id = 2) const uint TILE_LOG2 = 9;             // k
layout(constant_id = 3) const uint FIRST_RESIDENT_LEVEL = 9;  // L-L'+1: the finest level of the resident tail
layout(constant_id = 4) const uint REQUESTS_PACKED = 0;       // 1: a texel of the request image is one word, 0: 3 or 4
layout(constant_id = 30) const uint BORDER = 4;                // width of a tile's border in texels
layout(constant_id = 31) const uint REACHES = 0;               // 1: a filter may reach beyond a tile's border

const uint COLUMN_BITS = WIDTH_LOG2 - TILE_LOG2;
const uint ROW_BITS = HEIGHT_LOG2 - TILE_LOG2;
const uint BACKGROUND = 0xffffffffu;  // q of a pixel that the mesh does not cover

// Columns and rows of level 0's tiles: the paper's (wT^0, hT^0).
uvec2 tile_grid() { return uvec2(1u << COLUMN_BITS, 1u << ROW_BITS); }

ivec2 level_size(uint level) {
    return ivec2(max(1u << WIDTH_LOG2 >> level, 1u), max(1u << HEIGHT_LOG2 >> level, 1u));
}

// True if a row is on the other side of a pole; 2 x height rows are a full turn.
bool mirrored(uint level, ivec2 texel) {
    int rows = level_size(level).y;
    return (texel.y & (2 * rows - 1)) >= rows;
}

// Maps a texel that may lie outside the level into it. Columns wrap at the antimeridian. A row beyond a pole is the
// mirrored row half a turn away; 2 x height rows are a full turn. Sizes are powers of two.
ivec2 true_texel(uint level, ivec2 texel) {
    ivec2 size = level_size(level);
    int turn = texel.y & (2 * size.y - 1);
    bool beyond = mirrored(level, texel);
    return ivec2(texel.x + (beyond ? size.x / 2 : 0) & (size.x - 1), beyond ? 2 * size.y - 1 - turn : turn);
}

// (q, i, j) and the reach as the request image stores them. The packed form has q in the high bits. All ones is the
// background; no triple has this value, because the host rejects sizes that would allow it. A filter's reach is in the
// highest four bits; no reach has all four bits set.
uvec4 store_triple(uvec3 qij, uint reach) {
    uint first = REQUESTS_PACKED == 1 ? qij.x << (ROW_BITS + COLUMN_BITS) | qij.y << COLUMN_BITS | qij.z : qij.x;
    first |= reach << 28;
    return REQUESTS_PACKED == 1 ? uvec4(first, 0, 0, 0) : uvec4(first, qij.yz, 0);
}

uvec3 load_triple(uvec4 stored) {
    if (stored.x == BACKGROUND) return stored.xyz;
    uint first = REACHES == 1 ? stored.x & 0x0fffffffu : stored.x;
    if (REQUESTS_PACKED == 0) return uvec3(first, stored.yz);
    return uvec3(first >> (ROW_BITS + COLUMN_BITS), first >> COLUMN_BITS & ((1u << ROW_BITS) - 1u),
                 first & ((1u << COLUMN_BITS) - 1u));
}

// As load_triple, for a covered pixel. Helper invocations beyond the mesh's outline read the background. For them, this
// function returns a tile that exists, because their fetches must stay within the buffers.
uvec3 load_covered(uvec4 stored) { return load_triple(stored.x == BACKGROUND ? uvec4(0) : stored); }

uint load_reach(uint stored) { return REACHES == 0 || stored == BACKGROUND ? 0u : stored >> 28; }
