#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"
#include "common/view.glsl"

layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
layout(location = 0) out uvec4 requests;

void main() {
    vec2 dx = dFdxFine(from_origin), dy = dFdyFine(from_origin);
    Coordinate at = coordinate(triangle_origin, from_origin);
    Parallelogram f = footprint(dx, dy, at, view.limb / gl_FragCoord.w);
    uvec3 qij = uvec3(level(f), tile_row_column(at));
    requests = store_triple(qij, filter_reach(at, qij.yz, f, qij.x));
}
