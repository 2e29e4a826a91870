// Computes a pixel's colour from the tile pool (paper 1, section 4). All passes that texture include this file. Needs
// pyramid.glsl, footprint.glsl and tile_pool.glsl.
layout(constant_id = 9) const uint LITERAL_INTERPOLATION = 0;  // 1: C1 f + C2 (1 - f), as printed
layout(constant_id = 16) const uint FADE_IN = 0;                // 1: new tiles are blended in over some frames
// 1: the colour is the number of texels that the filter reads. A sample of two levels reads 8 texels, a sample of a
// single level 4.
layout(constant_id = 27) const uint COUNTS_TEXELS = 0;

#include "common/hash.glsl"

layout(binding = 2) uniform sampler2DArray tile_pool;  // mip 0: the tile's level, mip 1: the next coarser level

// A pixel's texture lookup.
struct Lookup {
    Coordinate at;
    uvec2 ij;     // row and column in level 0's grid
    uint q;       // in streamed levels, stage 1's q; in resident levels, computed from the unclamped e
    float f;      // weight of level q + 1
    float count;  // number of samples (nA)
    vec2 major;   // the footprint's longer side, in texels of level 0
    Parallelogram footprint;
};

// log2 of a positive finite number, with an error of at most 2^-13; a sampler's step between levels is usually 2^-8.
// The exponent is exact, so that the integer part of half the result is stage 1's q. On software drivers the built-in
// log2 needs a division and ten operations more than this function.
float log2_13(float x) {
    uint bits = floatBitsToUint(x);
    float t = uintBitsToFloat(bits & 0x7fffffu | 0x3f800000u) - 1.0;
    // A minimax polynomial that is exact at both ends, so the result is continuous across exponents.
    float fraction = t + t * (1.0 - t) * (0.43872575 + t * (0.08213072 * t - 0.23905827));
    return float(int(bits >> 23) - 127) + fraction;
}

Lookup lookup(uvec3 qij, Coordinate at, Parallelogram f, uint level_bias) {
    vec2 sides = squared_sides(f);
    bool usable = finite(sides.x);
    float count = usable && sides.x > 0.0 ? sample_count(sides) : 1.0;
    vec2 major = usable ? major_side(f) : vec2(0.0);
    float e = is_of_paper_3()         ? asked_level(f)
            : usable && sides.x > 0.0 ? 0.5 * log2_13(sides.x / (count * count))
                                      : float(qij.x);
    float biased = e + float(level_bias);
    uint q = min(qij.x + level_bias, FIRST_RESIDENT_LEVEL);
    if (q == FIRST_RESIDENT_LEVEL)
        q = uint(clamp(biased, float(q), float(max(WIDTH_LOG2, HEIGHT_LOG2))));
    // Magnification (e < 0) shows only level 0.
    float fraction = clamp(biased - float(q), 0.0, 1.0);
    return Lookup(at, qij.yz, q, FILTER == BILINEAR ? floor(fraction + 0.5) : fraction, count, major, f);
}

// A texel of a level, in the nearest resident tile of that level or a coarser one.
struct Found {
    ResidentTile tile;
    ivec2 local;  // in texels of the tile's level, relative to its payload
};

Found find_texel(uint level, ivec2 texel) {
    uvec2 ij = uvec2(texel.yx) << level >> TILE_LOG2;
    ResidentTile tile = find_resident(level, ij);
    return Found(tile, (texel >> int(tile.level - level)) - (ivec2(ij.yx >> tile.level) << int(TILE_LOG2)));
}

// The first texel of a tile's payload.
ivec2 corner_of(ResidentTile tile, uvec2 ij) { return ivec2(ij.yx >> tile.level) << int(TILE_LOG2); }

// One sample of both levels of a tile; `coarser` is the weight of the coarser level. `texels` is relative to the
// payload's corner.
vec4 bordered_sample(ResidentTile tile, vec2 texels, float coarser) {
    if (COUNTS_TEXELS == 1) {
        if (FILTER == BILINEAR) return vec4(4.0);
        return vec4(8.0);
    }
    float side = float((1u << TILE_LOG2) + 2 * BORDER);
    vec2 own = (texels + float(BORDER)) / side;
    if ((BORDER & 1u) == 0u) return textureLod(tile_pool, vec3(own, tile.slot), coarser);
    // With an odd border, the picture of the coarser level begins half a coarse texel before the picture of the tile's
    // own level.
    vec2 half_size = (0.5 * texels + float((BORDER + 1) / 2)) / (0.5 * side);
    vec4 finer = textureLod(tile_pool, vec3(own, tile.slot), 0.0);
    return mix(finer, textureLod(tile_pool, vec3(half_size, tile.slot), 1.0), coarser);
}

// A sample beyond the border is taken from the tile that holds its texel.
vec4 sample_anywhere(ResidentTile tile, uvec2 ij, vec2 texels, float coarser) {
    ivec2 texel = ivec2(floor(texels));
    // A loop instead of a branch, because software drivers run both sides of a branch.
    for (bool elsewhere = REACHES == 1 && outside(texel, sample_margin()); elsewhere; elsewhere = false) {
        vec2 within = texels - vec2(texel);
        ivec2 place = corner_of(tile, ij) + texel;
        uint level = tile.level;
        if (mirrored(level, place)) within.y = 1.0 - within.y;
        place = true_texel(level, place);
        Found found = find_texel(level, place);
        // A texel of a coarser tile covers several texels of the level.
        uint steps = found.tile.level - level;
        texels = vec2(found.local) + (vec2(place & ((1 << int(steps)) - 1)) + within) * power_of_half(steps);
        if (steps > 0u) coarser = float(LITERAL_INTERPOLATION);
        tile = found.tile;
    }
    return bordered_sample(tile, texels, coarser);
}

// The mean of nA samples spread along the footprint's longer side. Each sample interpolates two levels.
vec4 tile_samples(Lookup lookup, ResidentTile tile, float coarser) {
    vec2 centre = texels_in_tile(lookup.at, lookup.ij, tile.level);
    if (MAX_ANISOTROPY == 1) return bordered_sample(tile, centre, coarser);
    vec2 reach = lookup.major * power_of_half(tile.level);
    vec4 sum = vec4(0.0);
    for (float n = 0.5; n < lookup.count; n++)
        sum += sample_anywhere(tile, lookup.ij, centre + (n / lookup.count - 0.5) * reach, coarser);
    return COUNTS_TEXELS == 1 ? sum : sum / lookup.count;
}

// A texel's place in the tile pool. Mip 0 is the tile's own level, mip 1 the next coarser one.
struct Place {
    ivec3 at;
    int mip;
};

// The place of a level's texel, which may lie outside the level. `tile_level` is the level of the pixel's tile: `level`
// itself or the next finer one. A coarser substitute tile gives the texel that covers the wanted one.
Place place_of(uint level, ivec2 texel, uint tile_level) {
    texel = true_texel(level, texel);
    uvec2 ij = uvec2(texel.yx) << level >> TILE_LOG2;
    ResidentTile tile = find_resident(tile_level, ij);
    uint mip = tile.level < level ? 1 : 0;
    ivec2 corner = ivec2(ij.yx >> tile.level) << int(TILE_LOG2 - mip);
    ivec2 local = (texel >> int(tile.level + mip - level)) - corner + int((BORDER + mip) >> mip);
    return Place(ivec3(local, tile.slot), int(mip));
}

// One tap reads one texel (Pharr et al., "Filtering After Shading With Stochastic Texture Filtering", 2024). Its
// position along the longer side, its level and its texel are random, with the weights of tile_samples as
// probabilities. No tap mixes two texels, so no border is needed: a texel of a neighbouring tile is read from that
// tile.
vec4 tap(Lookup lookup, uint level, float coarser, vec4 chance) {
    uint coarsest = max(WIDTH_LOG2, HEIGHT_LOG2);
    uint from = level < coarsest && chance.z < coarser ? level + 1 : level;
    vec2 along = ((floor(chance.w * lookup.count) + 0.5) / lookup.count - 0.5) * lookup.major;
    ivec2 base = lookup.at.texel >> int(from);
    vec2 within = (vec2(lookup.at.texel - (base << int(from))) + lookup.at.fraction + along) * power_of_half(from);
    // 2^22 texels are four times the widest level. NaN may give any texel.
    ivec2 texel = base + ivec2(clamp(floor(within - 0.5 + chance.xy), -4194304.0, 4194304.0));
    Place place = place_of(from, texel, level);
    return COUNTS_TEXELS == 1 ? vec4(1.0) : texelFetch(tile_pool, place.at, place.mip);
}

// Four numbers in [0, 1) for tap n: the additive recurrence of the root of x^5 = x + 1 (M. Roberts, "The Unreasonable
// Effectiveness of Quasirandom Sequences", 2018). This sequence spreads a few taps more evenly than random numbers do.
// The start differs between pixels and between frames.
vec4 chances(uvec4 start, uint n) {
    uvec4 bits = start + n * uvec4(0xdb4f0b91u, 0xbbe05633u, 0xa0f2ec76u, 0x89e18285u);
    return vec4(bits >> 8) * power_of_half(24);
}

vec4 taps(Lookup lookup, uint level, float coarser, uvec4 start) {
    vec4 sum = vec4(0.0);
    for (uint n = 0; n < SAMPLES; n++) sum += tap(lookup, level, coarser, chances(start, n));
    return COUNTS_TEXELS == 1 ? sum : sum / float(SAMPLES);
}

// The pixel that paper 3's filters process: its coordinate, its tile, and the first texel of the tile's payload.
Coordinate near_at;
ResidentTile near_tile;
ivec2 near_corner;

// Number of texels that the published filters have read in this pixel, if COUNTS_TEXELS is set.
uint texels_read;

// A texel of the tile's level or of the next coarser level. `at` is relative to the payload's first texel. A texel
// beyond the tile's border is taken from the tile that holds it.
vec3 texel(ivec2 at, uint level) {
    if (COUNTS_TEXELS == 1) ++texels_read;
    uint mip = reads_two_levels() ? level - near_tile.level : 0u;
    Place place = Place(ivec3(at + int((BORDER + mip) >> mip), near_tile.slot), int(mip));
    ivec2 last = ivec2((((1 << int(TILE_LOG2)) + 2 * int(BORDER)) >> int(mip)) - 1);
    // A loop instead of a branch, because software drivers run both sides of a branch.
    for (bool elsewhere = clamp(place.at.xy, ivec2(0), last) != place.at.xy; elsewhere; elsewhere = false)
        place = place_of(level, (near_corner >> int(mip)) + at, near_tile.level);
    return texelFetch(tile_pool, place.at, reads_two_levels() ? place.mip : 0).rgb;
}

Spot spot_at(uint level) {
    ivec2 base = near_at.texel >> int(level);
    vec2 within = (vec2(near_at.texel - (base << int(level))) + near_at.fraction) * power_of_half(level);
    return Spot(base - (near_corner >> int(level - near_tile.level)), within);
}

#include "texture_mapping/surface_filter.glsl"

// Paper 3's filters: single texels through the page table.
vec4 tile_texels(Lookup lookup, ResidentTile tile, float coarser, uvec3 seed) {
    near_at = lookup.at;
    near_tile = tile;
    near_corner = corner_of(tile, lookup.ij);
    vec4 j = jacobian(lookup.footprint);
    uint coarsest = max(WIDTH_LOG2, HEIGHT_LOG2);
    if (FILTER == ELLIPSE) {
        bool whole = tile.level == coarsest;
        EllipseMean mean = ellipse_mean(j, ellipse(lookup.footprint), tile.level, whole, spot_at(tile.level));
        return COUNTS_TEXELS == 1 ? vec4(mean.fetched) : vec4(mean.colour, 1.0);
    }
    float det = determinant_of(lookup.footprint);
    texels_read = 0;
    vec3 mean = baseline_mean(j, det, max_line(), tile.level, coarser, coarsest, seed);
    return COUNTS_TEXELS == 1 ? vec4(texels_read) : vec4(mean, 1.0);
}

// The colour that one tile gives for a lookup.
vec4 shown_by(ResidentTile tile, Lookup lookup, uvec4 start) {
    // A coarser substitute (q' > q) shows only its own level.
    float f = tile.level == lookup.q ? lookup.f : 0.0;
    // Streamed and resident levels share one call, because software drivers run both sides of a branch.
    if (is_of_paper_3()) return tile_texels(lookup, tile, f, start.xyz);
    float coarser = LITERAL_INTERPOLATION == 1 ? 1.0 - f : f;
    return FILTER == STOCHASTIC ? taps(lookup, tile.level, coarser, start) : tile_samples(lookup, tile, coarser);
}

// The pixel's colour from the resident tiles, in linear light. `seed` is pixel and frame, for stochastic filters.
vec4 filtered(Lookup lookup, uvec3 seed) {
    // Taps of the ellipse hash the seed again for each tap. All other random numbers start from one hash of the seed.
    uvec4 start = FILTER == ELLIPSE_TAPS ? uvec4(seed, 0) : hash(uvec4(seed, 0));
    ResidentTile tile = find_resident(lookup.q, lookup.ij);
    vec4 colour = shown_by(tile, lookup, start);
    // A separate branch, because software drivers keep a loop's variables in memory, even if the loop never repeats.
    if (FADE_IN == 1) {
        // While a tile fades in, the rest of the weight goes to the tile shown before: the next coarser resident tile.
        float weight = tile.fade;
        colour *= 1.0 - weight;
        while (weight > 0.0) {
            tile = find_resident(tile.level + 1, lookup.ij);
            float rest = weight * tile.fade;
            colour += (weight - rest) * shown_by(tile, lookup, start);
            weight = rest;
        }
    }
    return colour;
}
