#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"
#include "common/view.glsl"
#include "virtual_texture/tile_pool.glsl"

// Checks each texel that texturing would filter: it must be the one that the pixel's (s, t) and level require. Texels
// of this texture are hashes of their level and position. They are fetched without a sampler.
layout(binding = 0) uniform utexture2D requests;
layout(binding = 2) uniform texture2DArray tile_pool;  // as bytes

layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
// 1 + the number of wrong texels; 0 for the background. Bit 30: the resident tail is shown. Bit 31: the pixel's own
// tile is not resident.
layout(location = 0) out uint verdict;

// The hash of src/texture/source/ruler.rs.
uint mix32(uint bits) {
    bits = (bits ^ bits >> 16) * 0x7feb352du;
    bits = (bits ^ bits >> 15) * 0x846ca68bu;
    return bits ^ bits >> 16;
}
uint ruler_hash(uint level, ivec2 texel) {
    return mix32(mix32(mix32(level + 0x9e3779b9u) ^ uint(texel.x)) ^ uint(texel.y));
}

// The first of the 2 x 2 texels of a bilinear sample at the coordinate, in exact integers.
ivec2 first_tap(Coordinate at, uint level) {
    ivec2 base = at.texel >> int(level);
    vec2 within = (vec2(at.texel - (base << level)) + at.fraction) * power_of_half(level);
    return base - ivec2(lessThan(within, vec2(0.5)));
}

// Number of wrong texels among the 4 texels in one of the tile's two levels. Step 0 is the tile's own level. Step 1 is
// the next coarser level; the coarsest level is its own next coarser level.
uint wrong_in_tile(Coordinate at, uvec2 ij, ResidentTile tile, uint step) {
    uint level = min(tile.level + step, max(WIDTH_LOG2, HEIGHT_LOG2));
    int size = int(1u << TILE_LOG2 >> step), border = int((BORDER + step) >> step);
    ivec2 stored = ivec2(int((1u << TILE_LOG2) + 2 * BORDER) >> step);
    ivec2 corner = ivec2(ij.yx >> tile.level) * size;
    ivec2 first = first_tap(at, level);
    uint wrong = 0;
    for (int n = 0; n < 4; n++) {
        ivec2 texel = first + ivec2(n & 1, n >> 1);
        ivec2 fetched = texel - corner + border;
        bool inside = all(greaterThanEqual(fetched, ivec2(0))) && all(lessThan(fetched, stored));
        uint found = packUnorm4x8(texelFetch(tile_pool, ivec3(fetched, tile.slot), int(step)));
        if (!inside || found != ruler_hash(level, true_texel(level, texel))) wrong++;
    }
    return wrong;
}

void main() {
    uvec3 qij = load_covered(texelFetch(requests, ivec2(gl_FragCoord.xy), 0));
    Coordinate at = coordinate(triangle_origin, from_origin);
    uint q = min(qij.x + view.level_bias, FIRST_RESIDENT_LEVEL);
    ResidentTile tile = find_resident(q, qij.yz);
    bool in_resident_tail = tile.level >= FIRST_RESIDENT_LEVEL;
    // A pixel of the resident tail checks all resident levels.
    uint last = in_resident_tail ? max(WIDTH_LOG2, HEIGHT_LOG2) : tile.level;
    uint wrong = 0;
    for (uint level = tile.level; level <= last; level++) {
        ResidentTile judged = find_resident(level, qij.yz);
        wrong += wrong_in_tile(at, qij.yz, judged, 0u) + wrong_in_tile(at, qij.yz, judged, 1u);
    }
    verdict = 1u + wrong | (in_resident_tail ? 1u << 30 : 0u) | (tile.level == q ? 0u : 1u << 31);
}
