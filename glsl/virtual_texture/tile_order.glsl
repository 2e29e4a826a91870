// Linear index of a tile in the tile mask: level by level, row by row. With own-level tile addresses the index equals
// Pyramid::tile_index. With level-0 addresses each level has as many cells as level 0. Needs pyramid.glsl.

// The grid of (i, j). 0: the grid of level 0, as in the paper; 1: the grid of the tile's own level.
layout(constant_id = 7) const uint OWN_LEVEL = 0;

uint mark_index(uvec3 qij) {
    uint cells = tile_grid().x * tile_grid().y;
    // With own-level addresses, levels 0 to q-1 have (1 - 4^-q) 4/3 times as many cells as level 0. The division by 3
    // has no remainder, so it is a multiplication by the inverse of 3 modulo 2^32.
    uint finer = OWN_LEVEL == 1 ? (cells - (cells >> 2u * qij.x)) * 0xaaaaaaabu * 4u : qij.x * cells;
    return finer + (qij.y << (COLUMN_BITS - (OWN_LEVEL == 1 ? qij.x : 0u))) + qij.z;
}

uvec3 triple_at(uint index) {
    uint q = 0, columns_log2 = COLUMN_BITS, cells = tile_grid().x * tile_grid().y;
    while (index >= cells) {
        index -= cells;
        q++;
        if (OWN_LEVEL == 1) {
            columns_log2--;
            cells >>= 2;
        }
    }
    return uvec3(q, index >> columns_log2, index & ((1u << columns_log2) - 1u));
}
