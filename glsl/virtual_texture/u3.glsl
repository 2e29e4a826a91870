// U3 as compute variants of stage 3 write it. Needs marks.glsl.
layout(binding = 1, scalar) buffer U3 {
    uint count;  // triples that the frame has, also where there is no room for them
    uvec3 triples[];
} u3;

// The triples of a word's marks, from place `at` on.
void append(uint word, uint mask, uint at) {
    for (; mask != 0u; mask &= mask - 1u, at++) {
        if (at < appending.capacity) u3.triples[at] = marked_triple(word, uint(findLSB(mask)));
    }
}
