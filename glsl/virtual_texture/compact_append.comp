#version 460
// variants LAYOUT: 0 1 2
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"

layout(local_size_x = 64) in;

#include "virtual_texture/tile_mask.glsl"
#include "virtual_texture/append.glsl"

void main() {
    uint word = line_invocation();
    if (word >= mask_words()) return;
    uint mask = load_mask(word);
    if (mask != 0u) append(word, mask, atomicAdd(visible_list.count, uint(bitCount(mask))));
}
