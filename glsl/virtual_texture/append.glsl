// Stage 3 of compute variants: set bits become triples. Needs tile_mask.glsl.
#include "virtual_texture/visible_list.glsl"

// Writes the triples of a word's set bits to consecutive entries, beginning with entry `at`. If LIST_PLACES is set,
// writes the bits' indices instead of triples.
void append(uint word, uint mask, uint at) {
    for (; mask != 0u; mask &= mask - 1u, at++) {
        uint bit = uint(findLSB(mask));
        if (LIST_PLACES == 1) put_place(at, 32u * word + bit);
        else put(at, marked_triple(word, bit));
    }
}
