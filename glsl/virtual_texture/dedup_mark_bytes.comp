#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_8bit_storage : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(push_constant, scalar) uniform MarkingFrame {
    uint number;  // 1 to 255
} frame;

layout(binding = 1, scalar) buffer Marks { uint8_t bytes[]; } marks;

// All that write a byte write the same: a plain store does, and last frame's marks need no clearing.
void main() {
    uvec3 qij = keyed_triple(stored_triple(gl_GlobalInvocationID.xy));
    if (qij.x >= FIRST_RESIDENT_LEVEL) return;
    uint index = mark_index(qij);
    if (uint(marks.bytes[index]) != frame.number) marks.bytes[index] = uint8_t(frame.number);
}
