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

layout(binding = 0) uniform utexture2D requests;

layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
#if LIT
layout(location = 2) in vec3 normal;
#include "common/light.glsl"
#endif
layout(location = 0) out vec4 colour;  // linear light

void main() {
    // The tile is exactly the one that stage 1 stored; it is not computed again.
    uvec3 qij = load_covered(texelFetch(requests, ivec2(gl_FragCoord.xy), 0));
    Coordinate at = coordinate(triangle_origin, from_origin);
    Parallelogram f = footprint(dFdxFine(from_origin), dFdyFine(from_origin), at, view.limb / gl_FragCoord.w);
    // A helper invocation, beside an edge of the mesh, only gives derivatives. Its own footprint can be unbounded.
    if (gl_HelperInvocation) return;
    colour = filtered(lookup(qij, at, f, view.level_bias), uvec3(gl_FragCoord.xy, view.noise));
#if LIT
    colour.rgb *= light(normal, view.sun);
#endif
}
