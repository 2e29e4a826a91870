// The texture's numbering (paper 1, section 2), the same letters: level 0 is 2^m x 2^n texels, tiles are 2^k a side.
layout(constant_id = 0) const uint WIDTH_LOG2 = 18;           // m
layout(constant_id = 1) const uint HEIGHT_LOG2 = 17;          // n
layout(constant_id = 2) const uint TILE_LOG2 = 9;             // k
layout(constant_id = 3) const uint FIRST_RESIDENT_LEVEL = 9;  // L-L'+1: q of a pixel that G1 textures
layout(constant_id = 4) const uint U1_PACKED = 0;             // 1: U1 is one word (q, i, j), else three

const uint COLUMN_BITS = WIDTH_LOG2 - TILE_LOG2;
const uint ROW_BITS = HEIGHT_LOG2 - TILE_LOG2;
const uint BACKGROUND = 0xffffffffu;  // q of a pixel that the mesh does not cover

// Tiles of level 0, the paper's (wT^0, hT^0).
uvec2 tile_grid() { return uvec2(1u << COLUMN_BITS, 1u << ROW_BITS); }

ivec2 level_size(uint level) {
    return ivec2(max(1u << WIDTH_LOG2 >> level, 1u), max(1u << HEIGHT_LOG2 >> level, 1u));
}

// The texel at a place that may lie any number of turns outside the level: columns wrap at the antimeridian; a row
// beyond a pole is the mirrored row half a turn away, and 2 x height rows are a full turn. Sizes are powers of two.
ivec2 true_texel(uint level, ivec2 texel) {
    ivec2 size = level_size(level);
    int turn = texel.y & (2 * size.y - 1);
    bool beyond = turn >= size.y;
    return ivec2(texel.x + (beyond ? size.x / 2 : 0) & (size.x - 1), beyond ? 2 * size.y - 1 - turn : turn);
}

// (q, i, j) as U1 stores it. Packed: q in the high bits; all ones is the background, which no triple reaches
// (the host refuses sizes where q would need the last value).
uvec4 store_triple(uvec3 qij) {
    return U1_PACKED == 1 ? uvec4(qij.x << (ROW_BITS + COLUMN_BITS) | qij.y << COLUMN_BITS | qij.z, 0, 0, 0)
                          : uvec4(qij, 0);
}

uvec3 load_triple(uvec4 stored) {
    if (U1_PACKED == 0 || stored.x == BACKGROUND) return stored.xyz;
    return uvec3(stored.x >> (ROW_BITS + COLUMN_BITS), stored.x >> COLUMN_BITS & ((1u << ROW_BITS) - 1u),
                 stored.x & ((1u << COLUMN_BITS) - 1u));
}
