// Finds the resident tile that shows a pixel (paper 1, section 4). Needs pyramid.glsl and footprint.glsl.
layout(constant_id = 10) const uint SINGLE_LEVEL = 9;  // each level from this one to the coarsest fits in one tile
layout(constant_id = 11) const uint SINGLE_SLOT = 0;   // slot of SINGLE_LEVEL's tile; coarser levels' tiles follow

// The page table. The cell of a tile names the tile that is shown for it: fade << 24 | level << 19 | slot.
layout(binding = 1) uniform utextureBuffer page_table;

struct ResidentTile {
    uint slot;   // layer of the tile pool (k1)
    uint level;  // q' >= q
    float fade;  // weight of the next coarser tile; above 0 while this tile fades in
};

// Index of a cell: a leading 1, then the bits of row and column. (i, j) is in level 0's grid.
uint display_place(uint q, uvec2 ij) {
    uint column_bits = COLUMN_BITS - min(q, COLUMN_BITS), row_bits = ROW_BITS - min(q, ROW_BITS);
    return (1u << row_bits | ij.x >> q) << column_bits | ij.y >> q;
}

// The nearest tile of level q or coarser in the tile pool, which always has the resident levels.
ResidentTile find_resident(uint q, uvec2 ij) {
    uint cell = texelFetch(page_table, int(display_place(q, ij))).x;
    if (q >= SINGLE_LEVEL) return ResidentTile(SINGLE_SLOT + q - SINGLE_LEVEL, q, 0.0);
    return ResidentTile(cell & 0x7ffffu, cell >> 19 & 31u, float(cell >> 24) / 255.0);
}

// The coordinate's position in its tile of level q, in texels of that level, without the border. The tile comes from
// the request image, so that rounding at an edge moves a sample into the border, but never out of the tile.
vec2 texels_in_tile(Coordinate at, uvec2 ij, uint q) {
    ivec2 corner = ivec2(ij.yx >> q) << (TILE_LOG2 + q);
    return (vec2(at.texel - corner) + at.fraction) * power_of_half(q);
}
