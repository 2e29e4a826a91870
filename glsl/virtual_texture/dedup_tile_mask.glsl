// Marks a tile in the tile mask, for compute variants of stage 2.
layout(binding = 1, r32ui) uniform uimage2D tile_mask;

// Sets bit q of texel (i, j). If the test reads an old value, the OR is repeated without harm.
void mark(uvec3 qij) {
    uint bit = 1u << qij.x;
    if ((IMAGE_ATOMIC_LOAD(tile_mask, ivec2(qij.zy)) & bit) == 0u) imageAtomicOr(tile_mask, ivec2(qij.zy), bit);
}
