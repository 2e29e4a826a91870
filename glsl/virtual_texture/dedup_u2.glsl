// U2 as an image that compute variants of stage 2 mark in.
layout(binding = 1, r32ui) uniform uimage2D u2;

// Sets bit q of texel (i, j). The test may read an old value: then the OR is done once too often.
void mark(uvec3 qij) {
    uint bit = 1u << qij.x;
    if ((imageLoad(u2, ivec2(qij.zy)).x & bit) == 0u) imageAtomicOr(u2, ivec2(qij.zy), bit);
}
