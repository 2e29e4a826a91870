#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"

// A vertex for each pixel: the baseline for the paper's blocks of pixels.
layout(location = 0) flat out uint mask;

void main() {
    uint width = uint(textureSize(requests, 0).x);
    uvec3 qij = addressed_triple(stored_triple(uvec2(uint(gl_VertexIndex) % width, uint(gl_VertexIndex) / width)));
    bool none = qij.x >= FIRST_RESIDENT_LEVEL;
    vec2 cell = 2.0 / vec2(tile_grid());
    // The point is at the texel's centre. Pixels that need no tile are clipped.
    gl_Position = none ? vec4(2.0, 2.0, 2.0, 1.0) : vec4((vec2(qij.zy) + 0.5) * cell - 1.0, 0.0, 1.0);
    gl_PointSize = 1.0;
    mask = 1u << min(qij.x, 31u);
}
