#version 460
// variants LAYOUT: 0 1 2
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"

layout(local_size_x = 64) in;

#include "virtual_texture/marks.glsl"
#include "virtual_texture/words.glsl"
#include "common/group_prefix.glsl"

layout(binding = 2, scalar) writeonly buffer Sums { uint words[]; } sums;

// The first half of an ordered list: how many marks each group has.
void main() {
    uint all = group_prefix(count_marks()).y;
    if (gl_LocalInvocationIndex == 0u) sums.words[line_group()] = all;
}
