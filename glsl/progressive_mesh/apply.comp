#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
// Sections 3 to 5 on the device: one step of what leads from a level to another, in one instance's slice of F.
// A range of splits runs at once, in any order: a new vertex's index is above those of all live ones, so the last of
// several splits of one corner is the one with the largest index, and the first of their collapses, which is the last
// to be undone, leaves the least. Greatest and least do not depend on an order, so no split waits for another.
// A permutation takes two steps, for a face must be read before its slot is filled.

layout(local_size_x = 64) in;

// Three words a split's corner: word of F, new vertex, vertex before. Behind all of them two words a moved face: slot
// that is filled going up, slot where the face comes from.
layout(scalar, binding = 0) readonly buffer Program { uint words[]; } program;
layout(scalar, binding = 1) buffer Indices { uint words[]; } indices;
// Faces between the two steps of a permutation.
layout(scalar, binding = 2) buffer Kept { uint words[]; } kept;

layout(push_constant, scalar) uniform Applying {
    // 0: splits; 1: a permutation's faces are kept; 2: they are placed.
    uint kind;
    // Inverses: collapses, and permutations backwards.
    uint down;
    // First word of the step in `program`, and how many corners or faces it has.
    uint first;
    uint count;
    // First word of the instance's slice.
    uint slice;
    uint kept_first;
} applying;

void write(uint n) {
    uint at = applying.first + 3 * n;
    uint word = applying.slice + program.words[at];
    if (applying.down == 0) {
        atomicMax(indices.words[word], program.words[at + 1]);
    } else {
        atomicMin(indices.words[word], program.words[at + 2]);
    }
}

void move(uint n) {
    bool keep = applying.kind == 1;
    // Kept is where the face comes from: going up the second of the two slots.
    uint slot = program.words[applying.first + 2 * n + uint(keep == (applying.down == 0))];
    uint face = applying.slice + 3 * slot;
    uint own = applying.kept_first + 3 * n;
    for (uint corner = 0; corner < 3; ++corner) {
        if (keep) {
            kept.words[own + corner] = indices.words[face + corner];
        } else {
            indices.words[face + corner] = kept.words[own + corner];
        }
    }
}

void main() {
    uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    for (uint n = gl_GlobalInvocationID.x; n < applying.count; n += stride) {
        if (applying.kind == 0) {
            write(n);
        } else {
            move(n);
        }
    }
}
