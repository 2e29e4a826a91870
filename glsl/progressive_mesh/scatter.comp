#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
// The net effect of a level change: writes each face that the host changed into its slot.

layout(local_size_x = 64) in;

// Four words for each face: slot, corners.
layout(scalar, binding = 0) readonly buffer Changes { uint words[]; } changes;
layout(scalar, binding = 1) buffer Indices { uint words[]; } indices;
#include "progressive_mesh/write_indices.glsl"

layout(push_constant, scalar) uniform Scattering {
    uint count;
    // First slot of the instance's slice.
    uint slice;
} scattering;

void main() {
    uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    for (uint n = gl_GlobalInvocationID.x; n < scattering.count; n += stride) {
        uint face = 3 * (scattering.slice + changes.words[4 * n]);
        for (uint corner = 0; corner < 3; ++corner) {
            set_index(face + corner, changes.words[4 * n + 1 + corner]);
        }
    }
}
