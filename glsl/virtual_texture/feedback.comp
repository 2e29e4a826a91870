#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"

// One pixel of each block of U1, as it is stored.
layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 7) const uint WORDS = 3;  // of a texel of U1

layout(binding = 0) uniform utexture2D u1;
layout(binding = 1, scalar) writeonly buffer Samples { uint words[]; } samples;

layout(push_constant, scalar) uniform Sampling {
    uvec2 block_log2;  // width and height of a block
    uvec2 offset;      // of the frame's pixel in every block
    uvec2 blocks;      // columns and rows
} sampling;

void main() {
    uvec2 block = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(block, sampling.blocks))) return;
    uvec2 pixel = (block << sampling.block_log2) + sampling.offset;
    // Blocks at the right and at the bottom may leave the picture.
    bool outside = any(greaterThanEqual(pixel, uvec2(textureSize(u1, 0))));
    uvec4 stored = outside ? uvec4(BACKGROUND) : texelFetch(u1, ivec2(pixel), 0);
    uint at = (block.y * sampling.blocks.x + block.x) * WORDS;
    for (uint n = 0; n < WORDS; n++) samples.words[at + n] = stored[n];
}
