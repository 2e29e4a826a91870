#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

// Counts each face's vertices that miss in a FIFO cache of 16 entries, which is empty at the first face (as in
// cache.rs). One invocation per draw, because each face depends on the faces before it.
layout(local_size_x = 1) in;
layout(binding = 0, scalar) readonly buffer Indices { uint words[]; } indices;
#include "progressive_mesh/indices.glsl"
layout(binding = 1, scalar) writeonly buffer Misses { uint faces[]; } misses;
layout(push_constant, scalar) uniform FaceRange {
    uint first;  // first face in the index buffer
    uint count;
} range;

const uint ENTRIES = 16;

void main() {
    uint cache[ENTRIES], next = 0;
    for (uint n = 0; n < ENTRIES; n++) cache[n] = 0xffffffffu;
    for (uint face = range.first; face < range.first + range.count; face++) {
        uint missed = 0;
        for (uint corner = 0; corner < 3; corner++) {
            uint vertex = index_at(3 * face + corner);
            bool holds = false;
            for (uint n = 0; n < ENTRIES; n++) holds = holds || cache[n] == vertex;
            if (!holds) {
                cache[next] = vertex;
                next = (next + 1) % ENTRIES;
                missed++;
            }
        }
        misses.faces[face] = missed;
    }
}
