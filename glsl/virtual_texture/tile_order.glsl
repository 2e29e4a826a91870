// Marks in a line: level by level, row by row (Pyramid::tile_index; with the paper's keying each level has M0's
// grid). Needs pyramid.glsl.
layout(constant_id = 7) const uint NATIVE_KEYING = 0;  // 0: (i, j) in M0, as printed; 1: in the tile's own level

uint mark_index(uvec3 qij) {
    uint cells = tile_grid().x * tile_grid().y;
    // Native: levels 0 to q-1 have (1 - 4^-q) 4/3 of level 0's cells; the division leaves no rest, so it is a product
    // with 3's inverse modulo 2^32.
    uint finer = NATIVE_KEYING == 1 ? (cells - (cells >> 2u * qij.x)) * 0xaaaaaaabu * 4u : qij.x * cells;
    return finer + (qij.y << (COLUMN_BITS - (NATIVE_KEYING == 1 ? qij.x : 0u))) + qij.z;
}

uvec3 triple_at(uint index) {
    uint q = 0, columns_log2 = COLUMN_BITS, cells = tile_grid().x * tile_grid().y;
    while (index >= cells) {
        index -= cells;
        q++;
        if (NATIVE_KEYING == 1) {
            columns_log2--;
            cells >>= 2;
        }
    }
    return uvec3(q, index >> columns_log2, index & ((1u << columns_log2) - 1u));
}
