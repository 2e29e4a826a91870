#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"
#include "common/view.glsl"
#include "virtual_texture/tile_pool.glsl"

// Checks each texel that paper 1's samples would filter: it must be the one that the pixel's (s, t) and level require.
// Texels of this texture are hashes of their level and position. They are fetched without a sampler.
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

// A tile's column and row in its level.
ivec2 place_of(ResidentTile tile, uvec2 ij) { return ivec2(ij.yx >> tile.level); }

// Number of wrong texels among the 2 x 2 texels from `first` in one of a tile's two levels. Step 0 is the tile's own
// level. Step 1 is the next coarser level; the coarsest level is its own next coarser level. `first` is relative to the
// payload.
uint wrong_in_tile(ResidentTile tile, ivec2 place, ivec2 first, uint step) {
    uint level = min(tile.level + step, max(WIDTH_LOG2, HEIGHT_LOG2));
    int size = int(1u << TILE_LOG2 >> step), border = int((BORDER + step) >> step);
    ivec2 stored = ivec2(int((1u << TILE_LOG2) + 2 * BORDER) >> step);
    uint wrong = 0;
    for (int n = 0; n < 4; n++) {
        ivec2 texel = first + ivec2(n & 1, n >> 1);
        ivec2 fetched = texel + border;
        bool inside = all(greaterThanEqual(fetched, ivec2(0))) && all(lessThan(fetched, stored));
        uint found = packUnorm4x8(texelFetch(tile_pool, ivec3(fetched, tile.slot), int(step)));
        if (!inside || found != ruler_hash(level, true_texel(level, texel + place * size))) wrong++;
    }
    return wrong;
}

// Number of wrong texels of one trilinear sample at the coordinate.
uint wrong_at(Coordinate at, uvec2 ij, ResidentTile tile) {
    uint wrong = 0, coarsest = max(WIDTH_LOG2, HEIGHT_LOG2);
    for (uint step = 0; step < 2u; step++) {
        ivec2 corner = place_of(tile, ij) * int(1u << TILE_LOG2 >> step);
        wrong += wrong_in_tile(tile, place_of(tile, ij), first_tap(at, min(tile.level + step, coarsest)) - corner, step);
    }
    return wrong;
}

// Number of wrong texels of the nA samples along the footprint, as `tile_samples` in filter.glsl. A sample beyond the
// border is wrong if its tile is not resident.
uint wrong_in_samples(Coordinate at, uvec2 ij, ResidentTile tile, Parallelogram f) {
    vec2 sides = squared_sides(f);
    float count = finite(sides.x) && sides.x > 0.0 ? sample_count(sides) : 1.0;
    vec2 centre = texels_in_tile(at, ij, tile.level), major = major_side(f) * power_of_half(tile.level);
    uint wrong = 0;
    for (float n = 0.5; n < count; n++) {
        vec2 texels = centre + (n / count - 0.5) * major;
        ivec2 texel = ivec2(floor(texels)), place = place_of(tile, ij);
        ResidentTile holder = tile;
        if (REACHES == 1 && outside(texel, sample_margin())) {
            vec2 within = texels - vec2(texel);
            ivec2 in_level = (place << int(TILE_LOG2)) + texel;
            if (mirrored(tile.level, in_level)) within.y = 1.0 - within.y;
            in_level = true_texel(tile.level, in_level);
            uvec2 other = uvec2(in_level.yx) << tile.level >> TILE_LOG2;
            holder = find_resident(tile.level, other);
            place = place_of(holder, other);
            texels = vec2(in_level - (place << int(TILE_LOG2))) + within;
        }
        if (holder.level != tile.level) {
            wrong++;
            continue;
        }
        for (uint step = 0; step < 2u; step++)
            wrong += wrong_in_tile(holder, place, ivec2(floor(texels * power_of_half(step) - 0.5)), step);
    }
    return wrong;
}

void main() {
    uvec3 qij = load_covered(texelFetch(requests, ivec2(gl_FragCoord.xy), 0));
    Coordinate at = coordinate(triangle_origin, from_origin);
    Parallelogram f = footprint(dFdxFine(from_origin), dFdyFine(from_origin), at, view.limb / gl_FragCoord.w);
    uint q = min(qij.x + view.level_bias, FIRST_RESIDENT_LEVEL);
    ResidentTile tile = find_resident(q, qij.yz);
    bool in_resident_tail = tile.level >= FIRST_RESIDENT_LEVEL;
    // A pixel of the resident tail checks all resident levels.
    uint last = in_resident_tail ? max(WIDTH_LOG2, HEIGHT_LOG2) : tile.level;
    uint wrong = 0;
    for (uint level = tile.level; level <= last; level++) wrong += wrong_at(at, qij.yz, find_resident(level, qij.yz));
    // No sample reaches beyond a tile of the resident tail without finding another one.
    if (MAX_ANISOTROPY != 1 && !in_resident_tail) wrong += wrong_in_samples(at, qij.yz, tile, f);
    verdict = 1u + wrong | (in_resident_tail ? 1u << 30 : 0u) | (tile.level == q ? 0u : 1u << 31);
}
