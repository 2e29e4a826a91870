// Stage 3 by groups that count their marks first. Each invocation has its own words, side by side. Needs marks.glsl.
layout(constant_id = 8) const uint WORDS_LOG2 = 4;  // words of an invocation

uint first_word() { return line_invocation() << WORDS_LOG2; }
uint end_word() { return min(first_word() + (1u << WORDS_LOG2), mark_words()); }

uint count_marks() {
    uint count = 0;
    for (uint word = first_word(); word < end_word(); word++) count += uint(bitCount(load_marks(word)));
    return count;
}
