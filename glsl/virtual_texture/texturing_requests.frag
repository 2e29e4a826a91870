#version 460
// variants FORM: 0 1 2 3
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "common/form.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"
#include "common/view.glsl"
#include "virtual_texture/tile_pool.glsl"
#include "virtual_texture/filter.glsl"

// Stage 1 and section 4 in one fragment shader: it computes the triple, stores it and samples its tile. The depth test
// leaves the triple of the visible fragment in the request image.
layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
#if LIT
layout(location = 2) in vec3 normal;
#include "common/light.glsl"
#endif
layout(location = 0) out vec4 colour;  // linear light
layout(location = 1) out uvec4 requests;

void main() {
    Coordinate at = coordinate(triangle_origin, from_origin);
    Parallelogram f = footprint(dFdxFine(from_origin), dFdyFine(from_origin), at, view.limb / gl_FragCoord.w);
    // A helper invocation, beside an edge of the mesh, only gives derivatives. Its own footprint can be unbounded.
    if (gl_HelperInvocation) return;
    uvec3 qij = uvec3(level(f), tile_row_column(at));
    requests = store_triple(qij, filter_reach(at, qij.yz, f, qij.x));
    colour = filtered(lookup(qij, at, f, view.level_bias), uvec3(gl_FragCoord.xy, view.noise));
#if LIT
    colour.rgb *= light(normal, view.sun);
#endif
}
