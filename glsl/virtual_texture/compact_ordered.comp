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

layout(binding = 2, scalar) readonly buffer Sums { uint words[]; } sums;

// Second pass of the ordered list: entries are in the order of the mask, whatever the order of the workgroups. Needs no
// atomics.
void main() {
    uint group = line_group(), here = 0;
    for (uint n = gl_LocalInvocationIndex; n < group; n += gl_WorkGroupSize.x) here += sums.words[n];
    uint finer = group_prefix(here).y;
    if (group == gl_NumWorkGroups.x * gl_NumWorkGroups.y - 1u && gl_LocalInvocationIndex == 0u) {
        visible_list.count = finer + sums.words[group];
    }
    if (sums.words[group] == 0u) return;  // uniform in the workgroup
    barrier();                                // the next prefix sum overwrites the memory of `finer`
    uint at = finer + group_prefix(count_marks()).x;
    for (uint word = first_word(); word < end_word(); word++) {
        uint mask = load_mask(word);
        append(word, mask, at);
        at += uint(bitCount(mask));
    }
}
