// Stage 3 of compute variants: marks become triples. Needs marks.glsl.
#include "virtual_texture/u3.glsl"

// The triples of a word's marks, from place `at` on.
void append(uint word, uint mask, uint at) {
    for (; mask != 0u; mask &= mask - 1u, at++) put(at, marked_triple(word, uint(findLSB(mask))));
}
