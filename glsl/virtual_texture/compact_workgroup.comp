#version 460
// variants LAYOUT: 0 1 2
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"

layout(local_size_x = 64) in;

#include "virtual_texture/tile_mask.glsl"
#include "virtual_texture/append.glsl"
#include "virtual_texture/words.glsl"
#include "common/group_prefix.glsl"

shared uint first_place;

// One atomic addition per workgroup.
void main() {
    uint count = count_marks();
    uvec2 prefix = group_prefix(count);
    if (gl_LocalInvocationIndex == 0u && prefix.y > 0u) first_place = atomicAdd(visible_list.count, prefix.y);
    barrier();
    if (count == 0u) return;
    uint at = first_place + prefix.x;
    for (uint word = first_word(); word < end_word(); word++) {
        uint mask = load_mask(word);
        append(word, mask, at);
        at += uint(bitCount(mask));
    }
}
