#version 460
// variants LAYOUT: 0 1 2
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"

layout(local_size_x = 64) in;

#include "virtual_texture/tile_mask.glsl"
#include "virtual_texture/words.glsl"
#include "common/group_prefix.glsl"

layout(binding = 2, scalar) writeonly buffer Sums { uint words[]; } sums;

// First pass of the ordered list: counts the set bits of each workgroup.
void main() {
    uint all = group_prefix(count_marks()).y;
    if (gl_LocalInvocationIndex == 0u) sums.words[line_group()] = all;
}
