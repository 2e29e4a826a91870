// The tile mask as stage 3 reads it, in one of three layouts. Needs pyramid.glsl, tile_order.glsl.
#define TEXELS 0  // an image: a texel for each tile of level 0, a bit for each level
#define BITS 1    // a buffer: a bit for each index of tile_order.glsl
#define BYTES 2   // a buffer: a byte in place of each of these bits; the byte holds the number of the frame that set it

#if LAYOUT == TEXELS
layout(binding = 0) uniform utexture2D tile_mask;

uint mask_words() { return tile_grid().x * tile_grid().y; }

uint load_mask(uint word) {
    return texelFetch(tile_mask, ivec2(word & (tile_grid().x - 1u), word >> COLUMN_BITS), 0).x;
}

uvec3 marked_triple(uint word, uint bit) { return uvec3(bit, word >> COLUMN_BITS, word & (tile_grid().x - 1u)); }
#else
layout(binding = 0, scalar) readonly buffer TileMask { uint words[]; } tile_mask;

uint mask_words() { return uint(tile_mask.words.length()); }

#if LAYOUT == BITS
uint load_mask(uint word) { return tile_mask.words[word]; }

uvec3 marked_triple(uint word, uint bit) { return triple_at(32u * word + bit); }
#else
layout(push_constant, scalar) uniform MarkingFrame {
    uint number;  // of the frame, 1 to 255
} marking_frame;

uint load_mask(uint word) {
    uint four = tile_mask.words[word], mask = 0;
    for (uint n = 0; n < 4; n++) mask |= uint((four >> 8u * n & 255u) == marking_frame.number) << n;
    return mask;
}

uvec3 marked_triple(uint word, uint bit) { return triple_at(4u * word + bit); }
#endif
#endif

#include "common/line.glsl"
