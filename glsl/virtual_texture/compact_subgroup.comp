#version 460
// variants LAYOUT: 0 1 2
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"

layout(local_size_x = 64) in;

#include "virtual_texture/tile_mask.glsl"
#include "virtual_texture/append.glsl"

// One atomic addition per subgroup; most subgroups have no set bit and skip it.
void main() {
    uint word = line_invocation();
    uint mask = word < mask_words() ? load_mask(word) : 0u;
    if (subgroupAll(mask == 0u)) return;
    uint count = uint(bitCount(mask)), before = subgroupExclusiveAdd(count), all = subgroupAdd(count), at = 0;
    if (subgroupElect()) at = atomicAdd(visible_list.count, all);
    append(word, mask, subgroupBroadcastFirst(at) + before);
}
