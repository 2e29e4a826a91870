// Which of the resident tiles shows a pixel (paper 1, section 4). Needs pyramid.glsl and footprint.glsl.
layout(constant_id = 8) const uint BORDER = 4;        // texels of the neighbours around each tile
layout(constant_id = 10) const uint SINGLE_LEVEL = 9;  // from here on a level is one tile, always in J1 ...
layout(constant_id = 11) const uint SINGLE_SLOT = 0;   // ... at this slot and those after it

// The display table, filled: each cell names the tile that shows its place, fade << 24 | level << 19 | slot.
layout(binding = 1) uniform utextureBuffer h1;

struct Resident {
    uint slot;   // k1, layer of J1
    uint level;  // q' >= q
    float fade;  // share of the picture that the next coarser tile still has: above 0 while this one fades in
};

// A cell's place: a one, then the bits of row and column. (i, j) are M0's.
uint display_place(uint q, uvec2 ij) {
    uint column_bits = COLUMN_BITS - min(q, COLUMN_BITS), row_bits = ROW_BITS - min(q, ROW_BITS);
    return (1u << row_bits | ij.x >> q) << column_bits | ij.y >> q;
}

// The nearest coarser tile from level q on that is in J1; the levels of G1 always are.
Resident find_resident(uint q, uvec2 ij) {
    uint cell = texelFetch(h1, int(display_place(q, ij))).x;
    if (q >= SINGLE_LEVEL) return Resident(SINGLE_SLOT + q - SINGLE_LEVEL, q, 0.0);
    return Resident(cell & 0x7ffffu, cell >> 19 & 31u, float(cell >> 24) / 255.0);
}

// Where in its tile of level q the coordinate lies, in texels of that level from the payload's corner.
// Relative to the tile that U1 names, so that rounding at an edge moves a sample into the border, never astray.
vec2 texels_in_tile(Coordinate at, uvec2 ij, uint q) {
    ivec2 corner = ivec2(ij.yx >> q) << (TILE_LOG2 + q);
    return (vec2(at.texel - corner) + at.fraction) * power_of_half(q);
}
