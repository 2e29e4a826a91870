#version 460
// variants LAYOUT: 0 1 2
#extension GL_GOOGLE_include_directive : require
#if LAYOUT == 2
#extension GL_EXT_shader_8bit_storage : require
#endif
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"
#include "virtual_texture/reach.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Runs after any variant of stage 2. Pixels' filters may also read neighbouring tiles: this pass marks them in the
// tile mask.
#if LAYOUT == 0
#include "virtual_texture/dedup_tile_mask.glsl"
#elif LAYOUT == 1
layout(binding = 1, scalar) buffer TileMask { uint words[]; } tile_mask;

void mark(uvec3 qij) {
    uint place = mark_index(qij), bit = 1u << (place & 31u);
    if ((ATOMIC_LOAD(tile_mask.words[place >> 5]) & bit) == 0u) atomicOr(tile_mask.words[place >> 5], bit);
}
#else
layout(push_constant, scalar) uniform MarkingFrame {
    uint number;  // of the frame, 1 to 255
} frame;

layout(binding = 1, scalar) buffer TileMask { uint8_t bytes[]; } tile_mask;

// All invocations that write a byte write the same value, as in dedup_mark_bytes.comp.
void mark(uvec3 qij) { tile_mask.bytes[mark_index(qij)] = uint8_t(frame.number); }
#endif

void main() {
    uvec3 stored = stored_triple(gl_GlobalInvocationID.xy);
    uint reach = load_reach(stored.x);
    for (uint n = 1u; n < 4u && reach != 0u; n++) {
        if (!reaches(reach, n)) continue;
        uvec3 qij = neighbour(load_triple(uvec4(stored, 0)), reach, n);
        if (OWN_LEVEL == 1) qij.yz >>= qij.x;
        mark(qij);
    }
}
