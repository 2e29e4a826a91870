#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

// Counts each face's vertices that miss in a FIFO cache of 16 entries, which is empty at the first face (as in
// cache/mod.rs). misses.rs explains the two rounds: threads simulate pieces, then one workgroup corrects the pieces.
layout(local_size_x = 64) in;
layout(constant_id = 2) const uint PIECE = 512;     // faces of a piece
layout(constant_id = 3) const uint REPLAYED = 128;  // faces before the piece that are simulated first
layout(binding = 0, scalar) readonly buffer Indices { uint words[]; } indices;
#include "progressive_mesh/indices.glsl"
layout(binding = 1, scalar) writeonly buffer Misses { uint faces[]; } misses;
// Two caches for each piece: before its first face and after its last face.
layout(binding = 2, scalar) buffer Caches { uint entries[]; } caches;
layout(push_constant, scalar) uniform FaceRange {
    uint first;  // first face in the index buffer
    uint count;
    uint first_piece;  // number of the range's first piece in `caches`
    uint corrects;     // 0: simulate all pieces; 1: simulate again the pieces that began with a wrong cache
} range;

const uint ENTRIES = 16;
uint cache[ENTRIES];  // the oldest entry first
shared uint first_wrong;

uint cache_before(uint piece) { return 2 * ENTRIES * (range.first_piece + piece); }
uint cache_after(uint piece) { return cache_before(piece) + ENTRIES; }

void save(uint at) {
    for (uint n = 0; n < ENTRIES; n++) caches.entries[at + n] = cache[n];
}

// The number of a face's vertices that miss; they replace the oldest entries.
uint missed(uint face) {
    uint count = 0;
    for (uint corner = 0; corner < 3; corner++) {
        uint vertex = index_at(3 * (range.first + face) + corner);
        bool holds = false;
        for (uint n = 0; n < ENTRIES; n++) holds = holds || cache[n] == vertex;
        if (!holds) {
            for (uint n = 1; n < ENTRIES; n++) cache[n - 1] = cache[n];
            cache[ENTRIES - 1] = vertex;
            count++;
        }
    }
    return count;
}

void simulate(uint piece) {
    uint end = min(PIECE * (piece + 1), range.count);
    for (uint face = PIECE * piece; face < end; face++) misses.faces[range.first + face] = missed(face);
    save(cache_after(piece));
}

// True if the piece began with the cache that the piece before it left.
bool follows(uint piece) {
    bool equal = true;
    for (uint n = 0; n < ENTRIES; n++) {
        equal = equal && caches.entries[cache_before(piece) + n] == caches.entries[cache_after(piece - 1) + n];
    }
    return equal;
}

void correct(uint pieces) {
    if (gl_LocalInvocationIndex == 0) first_wrong = pieces;
    barrier();
    for (uint piece = 1 + gl_LocalInvocationIndex; piece < pieces; piece += gl_WorkGroupSize.x) {
        if (!follows(piece)) atomicMin(first_wrong, piece);
    }
    barrier();
    if (gl_LocalInvocationIndex > 0) return;
    for (uint piece = first_wrong; piece < pieces; piece++) {
        if (follows(piece)) continue;
        for (uint n = 0; n < ENTRIES; n++) cache[n] = caches.entries[cache_after(piece - 1) + n];
        simulate(piece);
    }
}

void main() {
    uint pieces = (range.count + PIECE - 1) / PIECE, piece = gl_GlobalInvocationID.x;
    if (range.corrects == 1) {
        correct(pieces);
    } else if (piece < pieces) {
        for (uint n = 0; n < ENTRIES; n++) cache[n] = 0xffffffffu;
        uint begin = PIECE * piece;
        for (uint face = begin - min(begin, REPLAYED); face < begin; face++) missed(face);
        save(cache_before(piece));
        simulate(piece);
    }
}
