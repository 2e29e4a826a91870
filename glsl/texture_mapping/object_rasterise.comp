#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/object_space.glsl"

// Stage 2: a thread lists the fragments of a row of a polygon. The order of the rows in the list is arbitrary.
layout(local_size_x = 64) in;

layout(binding = 1, scalar) readonly buffer Polygons { RotatedTriangle of[]; } polygons;
layout(binding = 2, scalar) buffer Counts { uint fragments; uint depth_tests; uint sums; } counts;
layout(binding = 3, scalar) writeonly buffer Fragments { uvec2 of[]; } fragments;

bool covers(RotatedTriangle own, vec2 at) {
    return form(own.edges[0], at) >= 0.0 && form(own.edges[1], at) >= 0.0 && form(own.edges[2], at) >= 0.0;
}

void main() {
    uint row = gl_GlobalInvocationID.x;
    RotatedTriangle own = polygons.of[gl_WorkGroupID.y];
    if (int(row) >= own.count.y) return;
    uint inside = 0u;
    for (int column = 0; column < own.count.x; column++) inside += uint(covers(own, vec2(column, row)));
    if (inside == 0u) return;
    uint at = atomicAdd(counts.fragments, inside);
    for (int column = 0; column < own.count.x; column++) {
        if (!covers(own, vec2(column, row))) continue;
        if (at < object.capacity) fragments.of[at] = uvec2(gl_WorkGroupID.y, uint(column) | row << 16);
        at++;
    }
}
