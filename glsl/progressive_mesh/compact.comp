#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
// A rival on the device: of the full mesh's faces in their best order, those that are live at a level are copied in that
// order, with the vertices that they have there. Two steps: live faces of each group's part are counted; then each group
// sums those before it and places its own. No atomic addition, so the order is the list's.

layout(local_size_x = 256) in;

#include "common/group_prefix.glsl"

// Four words a face, best order first: its slot in the classical order, and its vertices in the full mesh.
layout(scalar, binding = 0) readonly buffer Ranked { uint words[]; } ranked;
// Of each vertex beyond level 0's the one that it replaces.
layout(scalar, binding = 1) readonly buffer SplitVertices { uint words[]; } split_vertices;
layout(scalar, binding = 2) buffer Counts { uint words[]; } counts;
layout(scalar, binding = 3) writeonly buffer Indices { uint words[]; } indices;

layout(push_constant, scalar) uniform Compacting {
    // 0: live faces are counted; 1: they are placed.
    uint kind;
    uint faces;
    // Of the level.
    uint live_faces;
    uint live_vertices;
    // Vertices of level 0.
    uint first_vertices;
    // First word of the instance's slice.
    uint slice;
    uint counts_first;
} compacting;

uint at_level(uint vertex) {
    while (vertex >= compacting.live_vertices) {
        vertex = split_vertices.words[vertex - compacting.first_vertices];
    }
    return vertex;
}

void main() {
    uint face = gl_GlobalInvocationID.x, group = gl_WorkGroupID.x;
    bool live = face < compacting.faces && ranked.words[4 * min(face, compacting.faces - 1u)] < compacting.live_faces;
    uvec2 own = group_prefix(live ? 1u : 0u);
    if (compacting.kind == 0u) {
        if (gl_LocalInvocationIndex == 0u) {
            counts.words[compacting.counts_first + group] = own.y;
        }
        return;
    }
    uint here = 0u;
    for (uint n = gl_LocalInvocationIndex; n < group; n += gl_WorkGroupSize.x) {
        here += counts.words[compacting.counts_first + n];
    }
    barrier();  // `own` was read from what the next prefix overwrites
    uint before = group_prefix(here).y;
    if (live) {
        uint at = compacting.slice + 3u * (before + own.x);
        for (uint corner = 0u; corner < 3u; ++corner) {
            indices.words[at + corner] = at_level(ranked.words[4u * face + 1u + corner]);
        }
    }
}
