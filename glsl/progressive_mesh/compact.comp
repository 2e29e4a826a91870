#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
// Compaction baseline: copies the live faces of a level in meshoptimizer's vertex-cache order of the full mesh. Each
// corner is replaced by the vertex that is live at the level. Step 0 counts the live faces of each workgroup. Step 1
// sums the counts of the earlier workgroups and writes the workgroup's faces. Prefix sums replace atomic additions, so
// the copied faces keep the order of `ranked`.

layout(local_size_x = 256) in;

#include "common/group_prefix.glsl"

// Four words for each face, in meshoptimizer's order: its slot in order of appearance (the coarsest mesh first, then
// split by split), and its three vertices in the full mesh.
layout(scalar, binding = 0) readonly buffer Ranked { uint words[]; } ranked;
// The vertex that each vertex beyond level 0 replaces.
layout(scalar, binding = 1) readonly buffer SplitVertices { uint words[]; } split_vertices;
layout(scalar, binding = 2) buffer Counts { uint words[]; } counts;
layout(scalar, binding = 3) buffer Indices { uint words[]; } indices;
#include "progressive_mesh/write_indices.glsl"

layout(push_constant, scalar) uniform Compacting {
    // 0: count the live faces; 1: write them.
    uint kind;
    uint faces;
    // Counts at the level.
    uint live_faces;
    uint live_vertices;
    // Number of vertices of level 0.
    uint first_vertices;
    // First index of the instance's slice.
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
    barrier();  // the next prefix overwrites the shared memory that `own` was read from
    uint before = group_prefix(here).y;
    if (live) {
        uint at = compacting.slice + 3u * (before + own.x);
        for (uint corner = 0u; corner < 3u; ++corner) {
            set_index(at + corner, at_level(ranked.words[4u * face + 1u + corner]));
        }
    }
}
