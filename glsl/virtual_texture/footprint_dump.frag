#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"
#include "common/view.glsl"

// Stage 1 that also writes its inputs: (s, t) and the derivatives.
layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
layout(location = 0) out uvec4 requests;
layout(location = 1) out vec4 coordinates;  // s, t, 0, 0
layout(location = 2) out vec4 derivatives;  // ds/dx, dt/dx, ds/dy, dt/dy; bounded at the limb, if the filter is

void main() {
    vec2 dx = dFdxFine(from_origin), dy = dFdyFine(from_origin);
    Coordinate at = coordinate(triangle_origin, from_origin);
    Parallelogram f = footprint(dx, dy, at, view.limb / gl_FragCoord.w);
    uvec3 qij = uvec3(level(f), tile_row_column(at));
    requests = store_triple(qij, filter_reach(at, qij.yz, f, qij.x));
    vec2 size = vec2(1u << WIDTH_LOG2, 1u << HEIGHT_LOG2);
    coordinates = vec4((vec2(at.texel) + at.fraction) / size, 0.0, 0.0);
    derivatives = BOUNDS_LIMB == 1 ? vec4(f.r1, f.r2) / size.xyxy : vec4(dx, dy);
}
