#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"

// Copies one texel of each block of the request image, as stored.
layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 7) const uint REQUEST_WORDS = 3;  // words per texel of the request image

layout(binding = 0) uniform utexture2D requests;
layout(binding = 1, scalar) writeonly buffer Samples { uint words[]; } samples;

layout(push_constant, scalar) uniform Sampling {
    uvec2 block_log2;  // width and height of a block, log2
    uvec2 offset;      // of this frame's pixel within every block
    uvec2 blocks;      // columns and rows of blocks
} sampling;

void main() {
    uvec2 block = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(block, sampling.blocks))) return;
    uvec2 pixel = (block << sampling.block_log2) + sampling.offset;
    // Blocks at the right and at the bottom may extend beyond the picture.
    bool outside = any(greaterThanEqual(pixel, uvec2(textureSize(requests, 0))));
    uvec4 stored = outside ? uvec4(BACKGROUND) : texelFetch(requests, ivec2(pixel), 0);
    uint at = (block.y * sampling.blocks.x + block.x) * REQUEST_WORDS;
    for (uint n = 0; n < REQUEST_WORDS; n++) samples.words[at + n] = stored[n];
}
