#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"

layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
layout(location = 0) out uvec4 u1;

void main() {
    vec2 dx = dFdxFine(from_origin), dy = dFdyFine(from_origin);
    uint q = level(squared_sides(footprint(dx, dy)));
    u1 = store_triple(uvec3(q, tile_row_column(coordinate(triangle_origin, from_origin))));
}
