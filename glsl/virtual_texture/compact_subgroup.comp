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

#include "virtual_texture/marks.glsl"
#include "virtual_texture/append.glsl"

// One atomic addition a subgroup; most subgroups have nothing to add.
void main() {
    uint word = line_invocation();
    uint mask = word < mark_words() ? load_marks(word) : 0u;
    if (subgroupAll(mask == 0u)) return;
    uint count = uint(bitCount(mask)), before = subgroupExclusiveAdd(count), all = subgroupAdd(count), at = 0;
    if (subgroupElect()) at = atomicAdd(u3.count, all);
    append(word, mask, subgroupBroadcastFirst(at) + before);
}
