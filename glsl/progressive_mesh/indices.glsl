// An index buffer as words of one index each, or of two indices if the mesh has fewer than 65,536 vertices. The
// including shader declares `indices`, a buffer of words.
layout(constant_id = 1) const uint INDICES_PER_WORD = 1;

uint half_of(uint word, uint n) {
    return bitfieldExtract(word, int(16 * (n & 1)), 16);
}

uint index_at(uint n) {
    return INDICES_PER_WORD == 1 ? indices.words[n] : half_of(indices.words[n >> 1], n);
}
