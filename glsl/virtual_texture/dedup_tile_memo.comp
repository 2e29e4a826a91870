#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"
#include "virtual_texture/dedup_tile_mask.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 8) const uint SIDE_LOG2 = 3;  // log2 of the side of an invocation's square of pixels

// The paper's memo: skips a pixel whose triple equals the last one.
void main() {
    uvec2 first = gl_GlobalInvocationID.xy << SIDE_LOG2;
    uvec3 last = uvec3(BACKGROUND);
    for (uint y = 0; y < 1u << SIDE_LOG2; y++) {
        for (uint x = 0; x < 1u << SIDE_LOG2; x++) {
            uvec3 stored = stored_triple(first + uvec2(x, y));
            if (same_triple(stored, last)) continue;
            last = stored;
            uvec3 qij = addressed_triple(stored);
            if (qij.x < FIRST_RESIDENT_LEVEL) mark(qij);
        }
    }
}
