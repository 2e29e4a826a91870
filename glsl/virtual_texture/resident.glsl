// Which of the resident tiles shows a pixel (paper 1, section 4). Needs pyramid.glsl and footprint.glsl.
layout(constant_id = 8) const uint BORDER = 4;        // texels of the neighbours around each tile
layout(constant_id = 10) const uint SINGLE_LEVEL = 9;  // from here on a level is one tile, always in J1 ...
layout(constant_id = 11) const uint SINGLE_SLOT = 0;   // ... at this slot and those after it

layout(binding = 1) uniform utexture2D h1;  // display table, one mip level for each q: fade << 24 | slot + 1, or 0

struct Resident {
    uint slot;   // k1, layer of J1
    uint level;  // q' >= q
    float fade;  // share of the picture that the next coarser tile still has: above 0 while this one fades in
};

// The nearest coarser tile from level q on that is in J1; the levels of G1 always are. (i, j) are M0's, straight
// from U1.
Resident find_resident(uint q, uvec2 ij) {
    for (; q < SINGLE_LEVEL; q++) {
        uint entry = texelFetch(h1, ivec2(ij.yx >> q), int(q)).x;
        if (entry != 0u) return Resident((entry & 0xffffffu) - 1u, q, float(entry >> 24) / 255.0);
    }
    return Resident(SINGLE_SLOT + q - SINGLE_LEVEL, q, 0.0);
}

// Where in its tile of level q the coordinate lies, in texels of that level from the payload's corner.
// Relative to the tile that U1 names, so that rounding at an edge moves a sample into the border, never astray.
vec2 texels_in_tile(Coordinate at, uvec2 ij, uint q) {
    ivec2 corner = ivec2(ij.yx >> q) << (TILE_LOG2 + q);
    return (vec2(at.texel - corner) + at.fraction) * power_of_half(q);
}
