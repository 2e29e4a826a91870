// The visible-tile list as shaders write it. An entry is a triple (q, i, j), or with LIST_PLACES one word: the tile's
// linear index (`mark_index` in tile_order.glsl). One word is faster on software drivers, which execute every store for
// each pixel, even if nothing is to be stored.
layout(constant_id = 26) const uint LIST_PLACES = 0;  // 1: entries are linear indices of tiles

#ifndef LIST_BINDING
#define LIST_BINDING 1
#endif

layout(binding = LIST_BINDING, scalar) buffer VisibleList {
    uint count;  // entries of the frame, including those beyond the capacity
    uint words[];
} visible_list;

void put(uint at, uvec3 triple) {
    uint first = 3u * at;
    if (first + 2u >= visible_list.words.length()) return;
    visible_list.words[first] = triple.x;
    visible_list.words[first + 1u] = triple.y;
    visible_list.words[first + 2u] = triple.z;
}

void put_place(uint at, uint place) {
    if (at < visible_list.words.length()) visible_list.words[at] = place;
}
