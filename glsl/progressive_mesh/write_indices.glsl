#include "progressive_mesh/indices.glsl"

// Requires that no other invocation writes the same index. Another invocation may write the other half of the word at
// the same time.
void set_index(uint n, uint vertex) {
    if (INDICES_PER_WORD == 1) {
        indices.words[n] = vertex;
    } else {
        uint old = half_of(atomicOr(indices.words[n >> 1], 0), n);
        atomicXor(indices.words[n >> 1], (old ^ vertex) << (16 * (n & 1)));
    }
}

// Replaces an index by the largest (or the smallest) of the index and all values that invocations write, in any order.
void limit_index(uint n, uint vertex, bool largest) {
    if (INDICES_PER_WORD == 1) {
        if (largest) {
            atomicMax(indices.words[n], vertex);
        } else {
            atomicMin(indices.words[n], vertex);
        }
        return;
    }
    uint word = atomicOr(indices.words[n >> 1], 0), old;
    do {
        old = word;
        uint limit = largest ? max(half_of(old, n), vertex) : min(half_of(old, n), vertex);
        word = atomicCompSwap(indices.words[n >> 1], old, bitfieldInsert(old, limit, int(16 * (n & 1)), 16));
    } while (word != old);
}
