#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
// Sections 3 to 5 on the device: one step between two levels, in one instance's slice of the index buffer. A range of
// splits runs at once, in any order. A new vertex has a larger index than all live vertices, so if several splits write
// one corner, the last split's vertex has the largest index (atomicMax). Going down, the first split is undone last,
// and the vertex that it replaced has the smallest index (atomicMin). Maximum and minimum do not depend on the order,
// so no split waits for another. A permutation takes two steps: all faces are read before any slot is written. The
// construction of a level does not depend on the slice's present indices.

layout(local_size_x = 64) in;
#include "common/line.glsl"

// Three words for each corner that a split changes: its index in the slice, the new vertex, the replaced vertex. Two
// words for each face that a permutation moves: its slot after going up, and its slot before.
layout(scalar, binding = 0) readonly buffer Program { uint words[]; } program;
layout(scalar, binding = 1) buffer Indices { uint words[]; } indices;
// The faces that the first step of a permutation saves for the second.
layout(scalar, binding = 2) buffer Kept { uint words[]; } kept;
// The tables of run/direct.rs: for each permutation whose whole order is stored (a keyframe) the number of the face in
// each slot; the faces of the full mesh; and the predecessor of each vertex.
layout(scalar, binding = 3) readonly buffer Tables { uint words[]; } tables;

#include "progressive_mesh/write_indices.glsl"

layout(push_constant, scalar) uniform Applying {
    // 0: splits; 1: save a permutation's faces; 2: write the saved faces to their slots; 3: construct a level.
    uint kind;
    // 1: the inverse step (collapses, or the inverse permutation).
    uint down;
    // First word of the step in `program`; for a construction, in `tables`.
    uint first;
    // Number of corners or faces.
    uint count;
    // First index of the instance's slice.
    uint slice;
    uint kept_first;
    // For a construction: the number of slots of its keyframe, the number of live vertices, and the first words of the
    // faces and of the predecessors in `tables`.
    uint listed;
    uint vertices;
    uint faces_at;
    uint predecessors_at;
} applying;

void write(uint n) {
    uint at = applying.first + 3 * n;
    bool up = applying.down == 0;
    limit_index(applying.slice + program.words[at], program.words[at + (up ? 1 : 2)], up);
}

void move(uint n) {
    bool keep = applying.kind == 1;
    // Kind 1 reads the source slot of the face, kind 2 writes its destination. Going up, the destination is the first
    // of the two words; going down, it is the second.
    uint slot = program.words[applying.first + 2 * n + uint(keep == (applying.down == 0))];
    uint face = applying.slice + 3 * slot;
    uint own = applying.kept_first + 3 * n;
    for (uint corner = 0; corner < 3; ++corner) {
        if (keep) {
            kept.words[own + corner] = index_at(face + corner);
        } else {
            set_index(face + corner, kept.words[own + corner]);
        }
    }
}

// The live vertex that replaces a vertex. If level 0 has no vertices, vertex 0 is its own predecessor.
uint live(uint vertex) {
    while (vertex >= applying.vertices) {
        uint predecessor = tables.words[applying.predecessors_at + vertex];
        if (predecessor == vertex) {
            break;
        }
        vertex = predecessor;
    }
    return vertex;
}

void construct(uint slot) {
    uint number = slot < applying.listed ? tables.words[applying.first + slot] : slot;
    for (uint corner = 0; corner < 3; ++corner) {
        uint vertex = tables.words[applying.faces_at + 3 * number + corner];
        set_index(applying.slice + 3 * slot + corner, live(vertex));
    }
}

void main() {
    uint n = line_invocation();
    if (n >= applying.count) return;
    if (applying.kind == 0) {
        write(n);
    } else if (applying.kind == 3) {
        construct(n);
    } else {
        move(n);
    }
}
