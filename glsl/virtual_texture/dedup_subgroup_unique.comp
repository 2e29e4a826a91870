#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"
#include "virtual_texture/dedup_tile_mask.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uvec3 broadcast_first(uvec3 stored) {
    return REQUESTS_PACKED == 1 ? uvec3(subgroupBroadcastFirst(stored.x)) : subgroupBroadcastFirst(stored);
}

// The first active lane sets the bit for all lanes with the same triple. These lanes leave the loop; then the next
// active lane is first.
void main() {
    uvec3 stored = stored_triple(gl_GlobalInvocationID.xy);
    uvec3 qij = addressed_triple(stored);
    bool waits = qij.x < FIRST_RESIDENT_LEVEL;
    while (waits) {
        if (same_triple(stored, broadcast_first(stored))) {
            if (subgroupElect()) imageAtomicOr(tile_mask, ivec2(qij.zy), 1u << qij.x);
            waits = false;
        }
    }
}
