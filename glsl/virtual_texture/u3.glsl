// U3 as shaders write it: triples, or one word for each, the place of its mark (tile_order.glsl). A software driver
// stores word by word and pixel by pixel, also where no pixel has anything to store.
layout(constant_id = 26) const uint U3_PLACES = 0;  // 1: places

#ifndef U3_BINDING
#define U3_BINDING 1
#endif

layout(binding = U3_BINDING, scalar) buffer U3 {
    uint count;  // entries that the frame has, also where there is no room for them
    uint words[];
} u3;

void put(uint at, uvec3 triple) {
    uint first = 3u * at;
    if (first + 2u >= u3.words.length()) return;
    u3.words[first] = triple.x;
    u3.words[first + 1u] = triple.y;
    u3.words[first + 2u] = triple.z;
}

void put_place(uint at, uint place) {
    if (at < u3.words.length()) u3.words[at] = place;
}
