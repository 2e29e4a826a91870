#version 460
// variants BLOCK_LOG2: 0 1 2 3 4
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/blocks.glsl"

// A point has 5 components (position and mask), and Vulkan guarantees 1024 components per invocation. So a block of
// 16 x 16 texels (p = 4) is split into two invocations of half a block each.
#define SIDE (1 << BLOCK_LOG2)
#define INVOCATIONS (BLOCK_LOG2 > 3 ? 2 : 1)
layout(points, invocations = INVOCATIONS) in;
layout(points, max_vertices = SIDE * SIDE / INVOCATIONS) out;

layout(constant_id = 6) const uint MEMO = 1;           // emit only if the triple differs from the last one
// The grid of (i, j). 0: the grid of level 0, as in the paper; 1: the grid of the tile's own level.
layout(constant_id = 7) const uint OWN_LEVEL = 0;

layout(binding = 0) uniform utexture2D requests;

layout(location = 0) flat in uvec2 block[];
out gl_PerVertex { vec4 gl_Position; };
layout(location = 0) flat out uint mask;

void main() {
    uvec2 first = block[0] << BLOCK_LOG2;
    first.y += gl_InvocationID * (SIDE / INVOCATIONS);
    uvec2 end = min(first + uvec2(SIDE, SIDE / INVOCATIONS), blocks.size);
    vec2 cell = 2.0 / vec2(tile_grid());
    uvec3 last = uvec3(BACKGROUND);
    for (uint it = first.y; it < end.y; it++) {
        for (uint jt = first.x; jt < end.x; jt++) {
            uvec3 qij = load_triple(texelFetch(requests, ivec2(jt, it), 0));
            if (qij.x >= FIRST_RESIDENT_LEVEL) continue;  // resident levels and background need no tile
            if (OWN_LEVEL == 1) qij.yz >>= qij.x;
            if (MEMO == 1 && qij == last) continue;
            last = qij;
            // The point is at the texel's centre. A point at the corner that the paper prints, -1 + 2j/wT, sets the
            // texel to the left and above, so tiles are lost.
            gl_Position = vec4((vec2(qij.zy) + 0.5) * cell - 1.0, 0.0, 1.0);
            mask = 1u << qij.x;
            EmitVertex();
            EndPrimitive();
        }
    }
}
