#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_8bit_storage : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"

// C.-F. Hollemeersch, B. Pieters, P. Lambert and R. Van de Walle, "Accelerating Virtual Texturing Using CUDA", GPU Pro,
// 2010.

layout(local_size_x = 8, local_size_y = 8) in;

layout(push_constant, scalar) uniform MarkingFrame {
    uint number;  // of the frame, 1 to 255
} frame;

layout(binding = 1, scalar) buffer TileMask { uint8_t bytes[]; } tile_mask;

// All invocations that write a byte write the same value. Vulkan has no byte atomics, so these stores and the load
// before them are data races in Vulkan's memory model. Every known device nevertheless stores the value. Bytes of
// earlier frames hold other numbers and need no clearing.
void main() {
    uvec3 qij = addressed_triple(stored_triple(gl_GlobalInvocationID.xy));
    if (qij.x >= FIRST_RESIDENT_LEVEL) return;
    uint index = mark_index(qij);
    if (uint(tile_mask.bytes[index]) != frame.number) tile_mask.bytes[index] = uint8_t(frame.number);
}
