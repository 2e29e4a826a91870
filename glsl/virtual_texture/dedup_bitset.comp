#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"

layout(local_size_x = 16, local_size_y = 16) in;
layout(constant_id = 8) const uint SIDE_LOG2 = 4;  // n: an invocation reads 2^n x 2^n pixels
layout(constant_id = 9) const uint MASK_WORDS = 1;      // words that hold one bit per tile of the pyramid

layout(binding = 1, scalar) buffer TileMask { uint words[]; } tile_mask;

shared uint bits[MASK_WORDS];

void set(uint index) {
    uint word = index >> 5, bit = 1u << (index & 31u);
    if ((ATOMIC_LOAD(bits[word]) & bit) == 0u) atomicOr(bits[word], bit);
}

// Each step reads one contiguous block of pixels, so that neighbouring invocations read neighbouring pixels.
void main() {
    const uint invocations = gl_WorkGroupSize.x * gl_WorkGroupSize.y;
    for (uint word = gl_LocalInvocationIndex; word < MASK_WORDS; word += invocations) bits[word] = 0;
    barrier();
    uvec2 first = (gl_WorkGroupID.xy * gl_WorkGroupSize.xy << SIDE_LOG2) + gl_LocalInvocationID.xy;
    uvec3 last = uvec3(BACKGROUND);
    for (uint y = 0; y < 1u << SIDE_LOG2; y++) {
        for (uint x = 0; x < 1u << SIDE_LOG2; x++) {
            uvec3 stored = stored_triple(first + uvec2(x, y) * gl_WorkGroupSize.xy);
            if (same_triple(stored, last)) continue;
            last = stored;
            uvec3 qij = addressed_triple(stored);
            if (qij.x < FIRST_RESIDENT_LEVEL) set(mark_index(qij));
        }
    }
    barrier();
    for (uint word = gl_LocalInvocationIndex; word < MASK_WORDS; word += invocations) {
        uint mine = bits[word];
        if ((mine & ~ATOMIC_LOAD(tile_mask.words[word])) != 0u) atomicOr(tile_mask.words[word], mine);
    }
}
