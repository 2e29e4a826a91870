#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"
#include "virtual_texture/dedup_tile_mask.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

// Hash table with open addressing and 256 slots. A workgroup needs at most one slot for each of its 256 invocations,
// and usually fewer than ten in total.
#define SLOTS 256u
#define PROBES 8
#define EMPTY 0xffffffffu  // not a cell: the tile mask is an image and has fewer texels

shared uint cells[SLOTS];
shared uint masks[SLOTS];

// Sets the bit of a cell in the table. Returns false if no slot is found within PROBES probes.
bool put(uint cell, uint bit) {
    uint slot = cell * 2654435769u >> 24;  // Fibonacci hashing: 2^32 / golden ratio; the product's top 8 bits
    for (int probe = 0; probe < PROBES; probe++, slot = (slot + 1u) % SLOTS) {
        uint found = ATOMIC_LOAD(cells[slot]);
        if (found == EMPTY) {
            found = atomicCompSwap(cells[slot], EMPTY, cell);
            if (found == EMPTY) found = cell;
        }
        if (found == cell) {
            if ((ATOMIC_LOAD(masks[slot]) & bit) == 0u) atomicOr(masks[slot], bit);
            return true;
        }
    }
    return false;
}

void main() {
    cells[gl_LocalInvocationIndex] = EMPTY;
    masks[gl_LocalInvocationIndex] = 0;
    barrier();
    uvec3 qij = addressed_triple(stored_triple(gl_GlobalInvocationID.xy));
    if (qij.x < FIRST_RESIDENT_LEVEL && !put(qij.y << COLUMN_BITS | qij.z, 1u << qij.x)) mark(qij);
    barrier();
    uint mask = masks[gl_LocalInvocationIndex], cell = cells[gl_LocalInvocationIndex];
    if (mask == 0u) return;
    ivec2 at = ivec2(cell & (tile_grid().x - 1u), cell >> COLUMN_BITS);
    if ((~IMAGE_ATOMIC_LOAD(tile_mask, at) & mask) != 0u) imageAtomicOr(tile_mask, at, mask);
}
