#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"
#include "virtual_texture/dedup_tile_mask.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    uvec3 qij = addressed_triple(stored_triple(gl_GlobalInvocationID.xy));
    if (qij.x < FIRST_RESIDENT_LEVEL) imageAtomicOr(tile_mask, ivec2(qij.zy), 1u << qij.x);
}
