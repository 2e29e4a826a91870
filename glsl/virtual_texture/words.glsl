// For variants of stage 3 whose workgroups count their set bits first. Each invocation reads consecutive words. Needs
// tile_mask.glsl.
layout(constant_id = 8) const uint WORDS_LOG2 = 4;  // log2 of the words per invocation

uint first_word() { return line_invocation() << WORDS_LOG2; }
uint end_word() { return min(first_word() + (1u << WORDS_LOG2), mask_words()); }

uint count_marks() {
    uint count = 0;
    for (uint word = first_word(); word < end_word(); word++) count += uint(bitCount(load_mask(word)));
    return count;
}
