#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/blocks.glsl"

layout(location = 0) flat out uvec2 block;

void main() { block = uvec2(uint(gl_VertexIndex) % blocks.columns, uint(gl_VertexIndex) / blocks.columns); }
