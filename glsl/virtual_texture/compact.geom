#version 460
// variants BLOCK_LOG2: 0 1 2
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/blocks.glsl"

// At most 16 streamed levels: 16 texels x 16 bits x 3 components = 768 of the 1024 that Vulkan promises, and 256
// points, its promise too. (Only 2^20 x 2^20 texels in tiles of 16 have a seventeenth.)
#define SIDE (1 << BLOCK_LOG2)
layout(points) in;
layout(points, max_vertices = SIDE * SIDE * 16) out;

layout(binding = 0) uniform utexture2D u2;

layout(location = 0) flat in uvec2 block[];
// Transform feedback appends to U3; nothing is rasterised, so no position is written.
layout(location = 0, xfb_buffer = 0, xfb_stride = 12, xfb_offset = 0) flat out uvec3 qij;

void main() {
    uvec2 first = block[0] << BLOCK_LOG2;
    uvec2 end = min(first + SIDE, blocks.size);
    for (uint i = first.y; i < end.y; i++) {
        for (uint j = first.x; j < end.x; j++) {
            uint mask = texelFetch(u2, ivec2(j, i), 0).x;
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
