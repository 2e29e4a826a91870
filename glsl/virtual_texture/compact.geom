#version 460
// variants BLOCK_LOG2: 0 1 2
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/blocks.glsl"

// A block has at most 16 texels with 16 bits each, so an invocation emits at most 256 points, the number that Vulkan
// guarantees. 256 points take 768 of the 1024 guaranteed components. Textures with 17 streamed levels (2^20 x 2^20
// texels in tiles of 16) are rejected.
#define SIDE (1 << BLOCK_LOG2)
layout(points) in;
layout(points, max_vertices = SIDE * SIDE * 16) out;

layout(binding = 0) uniform utexture2D tile_mask;

layout(location = 0) flat in uvec2 block[];
// Transform feedback appends to the visible-tile list; nothing is rasterised, so no position is written.
layout(location = 0, xfb_buffer = 0, xfb_stride = 12, xfb_offset = 0) flat out uvec3 qij;

void main() {
    uvec2 first = block[0] << BLOCK_LOG2;
    uvec2 end = min(first + SIDE, blocks.size);
    for (uint i = first.y; i < end.y; i++) {
        for (uint j = first.x; j < end.x; j++) {
            uint mask = texelFetch(tile_mask, ivec2(j, i), 0).x;
            if (mask == 0u) continue;
            for (uint q = 0; q < FIRST_RESIDENT_LEVEL; q++) {
                if ((mask & 1u << q) == 0u) continue;
                qij = uvec3(q, i, j);
                EmitVertex();
                EndPrimitive();
            }
        }
    }
}
