#version 460
// variants FORM: 0 1 2 3
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "common/form.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"
#include "common/view.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/tile_pool.glsl"
#include "virtual_texture/filter.glsl"
#include "virtual_texture/reach.glsl"

// Stage 1, stage 2 and section 4 in one fragment shader: it computes the triple, marks the tile and samples it. The
// triple is never stored. Without early tests, a fragment that fails the depth test would still mark its tile.
layout(early_fragment_tests) in;

layout(constant_id = 25) const uint LISTS = 1;  // 0: marks nothing; 1: marks tiles; 2: marks and lists tiles

// The mask is a texel buffer with one word per texel, because software drivers load the texels of several pixels at
// once.
layout(binding = 3, r32ui) uniform uimageBuffer tile_mask;

#define LIST_BINDING 4
#include "virtual_texture/visible_list.glsl"

layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
#if LIT
layout(location = 2) in vec3 normal;
#include "common/light.glsl"
#endif
layout(location = 0) out vec4 colour;  // linear light

// The test may read an old value; then the OR is repeated without harm. Bits are only set here, never cleared, so a bit
// that reads as set is set. The OR returns an unset bit to exactly one fragment. Only that fragment appends, so each
// triple is listed once.
void mark(uvec3 qij) {
    if (OWN_LEVEL == 1) qij.yz >>= qij.x;
    uint place = mark_index(qij);
    int word = int(place >> 5);
    uint bit = 1u << (place & 31u);
    if ((IMAGE_ATOMIC_LOAD(tile_mask, word) & bit) == 0u) {
        uint before = imageAtomicOr(tile_mask, word, bit);
        if (LISTS == 2 && (before & bit) == 0u) put_place(atomicAdd(visible_list.count, 1u), place);
    }
}

void main() {
    Coordinate at = coordinate(triangle_origin, from_origin);
    Parallelogram f = footprint(dFdxFine(from_origin), dFdyFine(from_origin), at, view.limb / gl_FragCoord.w);
    // A helper invocation, beside an edge of the mesh, only gives derivatives. Its own footprint can be unbounded.
    if (gl_HelperInvocation) return;
    uvec3 qij = uvec3(level(f), tile_row_column(at));
    if (LISTS != 0 && qij.x < FIRST_RESIDENT_LEVEL) {
        mark(qij);
        uint reach = filter_reach(at, qij.yz, f, qij.x);
        for (uint n = 1u; n < 4u && reach != 0u; n++)
            if (reaches(reach, n)) mark(neighbour(qij, reach, n));
    }
    colour = filtered(lookup(qij, at, f, view.level_bias), uvec3(gl_FragCoord.xy, view.noise));
#if LIT
    colour.rgb *= light(normal, view.sun);
#endif
}
