#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"
#include "virtual_texture/dedup_u2.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uvec3 broadcast_first(uvec3 stored) {
    return U1_PACKED == 1 ? uvec3(subgroupBroadcastFirst(stored.x)) : subgroupBroadcastFirst(stored);
}

// One lane marks for all that hold the same triple; those are done, and the next lane has its turn.
void main() {
    uvec3 stored = stored_triple(gl_GlobalInvocationID.xy);
    uvec3 qij = keyed_triple(stored);
    bool waits = qij.x < FIRST_RESIDENT_LEVEL;
    while (waits) {
        if (same_triple(stored, broadcast_first(stored))) {
            if (subgroupElect()) imageAtomicOr(marks, ivec2(qij.zy), 1u << qij.x);
            waits = false;
        }
    }
}
