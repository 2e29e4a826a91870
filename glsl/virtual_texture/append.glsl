// Stage 3 of compute variants: marks become triples. Needs marks.glsl.
#include "virtual_texture/u3.glsl"

// The triples of a word's marks, from entry `at` on; places are there where marks are bits in a line.
void append(uint word, uint mask, uint at) {
    for (; mask != 0u; mask &= mask - 1u, at++) {
        uint bit = uint(findLSB(mask));
        if (U3_PLACES == 1) put_place(at, 32u * word + bit);
        else put(at, marked_triple(word, bit));
    }
}
