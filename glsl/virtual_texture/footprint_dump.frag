#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"

// Stage 1 with its inputs laid open: (s, t) and the derivatives beside the triple.
layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
layout(location = 0) out uvec4 u1;
layout(location = 1) out vec4 coordinates;  // s, t, 0, 0
layout(location = 2) out vec4 derivatives;  // ds/dx, dt/dx, ds/dy, dt/dy

void main() {
    vec2 dx = dFdxFine(from_origin), dy = dFdyFine(from_origin);
    uint q = level(squared_sides(footprint(dx, dy)));
    Coordinate at = coordinate(triangle_origin, from_origin);
    u1 = store_triple(uvec3(q, tile_row_column(at)));
    vec2 size = vec2(1u << WIDTH_LOG2, 1u << HEIGHT_LOG2);
    coordinates = vec4((vec2(at.texel) + at.fraction) / size, 0.0, 0.0);
    derivatives = vec4(dx, dy);
}
