// U2 as compute variants of stage 2 mark in it.
layout(binding = 1, r32ui) uniform uimage2D marks;

// Sets bit q of texel (i, j). The test may read an old value: then the OR is done once too often.
void mark(uvec3 qij) {
    uint bit = 1u << qij.x;
    if ((imageLoad(marks, ivec2(qij.zy)).x & bit) == 0u) imageAtomicOr(marks, ivec2(qij.zy), bit);
}
