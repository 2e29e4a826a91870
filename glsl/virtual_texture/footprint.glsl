// Arithmetic of stage 1 (paper 1, section 2.1): texture coordinate, footprint, level. Needs pyramid.glsl.
layout(constant_id = 24) const uint PIXEL_LOG2 = 0;    // n: a pixel represents 2^n x 2^n pixels of the picture

// A texel of level 0 and the position in it. An f32 alone has steps of 1/64 texel at 2^18 texels and 1/16 at 2^20.
struct Coordinate {
    ivec2 texel;
    vec2 fraction;  // [0, 1)
};

#include "common/exact.glsl"

// s = origin / 2^32 + offset. The origin's part is exact integer arithmetic, and the offset is small.
Coordinate coordinate(uvec2 origin, vec2 offset) {
    uvec2 whole = uvec2(origin.x >> (32 - WIDTH_LOG2), origin.y >> (32 - HEIGHT_LOG2));
    // in 2^-32 texel; 0 for sides of 2^10 texels or more, because origins are multiples of 2^22
    uvec2 rest = uvec2(origin.x << WIDTH_LOG2, origin.y << HEIGHT_LOG2);
    vec2 texels = offset * vec2(1u << WIDTH_LOG2, 1u << HEIGHT_LOG2) + vec2(rest) * power_of_half(32);
    // A position 2^22 texels away is outside every texture. NaN may give any value; `level` then is a resident level.
    vec2 steps = clamp(floor(texels), -4194304.0, 4194304.0);
    return Coordinate(ivec2(whole) + ivec2(steps), texels - steps);
}

// Row i and column j in level 0's grid, with the paper's clamps for t = 1 and s = 1.
uvec2 tile_row_column(Coordinate at) {
    ivec2 tile = clamp(at.texel >> int(TILE_LOG2), ivec2(0), ivec2(tile_grid()) - 1);
    return uvec2(tile.y, tile.x);
}

// The parallelogram's sides in texels of level 0.
struct Parallelogram {
    vec2 r1;  // (s_x, t_x)
    vec2 r2;  // (s_y, t_y)
};

#include "texture_mapping/footprint.glsl"
#include "texture_mapping/weights.glsl"
#include "texture_mapping/ellipse_level.glsl"
#include "texture_mapping/baseline_level.glsl"
#include "texture_mapping/surface_filter_level.glsl"

// The footprint as paper 3's Jacobian: rows (s_x, s_y) and (t_x, t_y).
vec4 jacobian(Parallelogram f) { return vec4(f.r1.x, f.r2.x, f.r1.y, f.r2.y); }
float determinant_of(Parallelogram f) { return f.r1.x * f.r2.y - f.r2.x * f.r1.y; }

// `limb` is the width of the pixel on the fragment's surface divided by the sphere's radius (p / R in
// texture_mapping/footprint.glsl); 0 if the mesh is not a sphere.
Parallelogram footprint(vec2 dx, vec2 dy, Coordinate at, float limb) {
    vec2 size = vec2(1u << WIDTH_LOG2, 1u << HEIGHT_LOG2), pixel = size * power_of_half(PIXEL_LOG2);  // exact
    Parallelogram f = Parallelogram(pixel * dx, pixel * dy);
    if (BOUNDS_LIMB == 0) return f;
    float most = max_major_texels(limb * power_of_half(PIXEL_LOG2), size.y);
    float across = sin(3.14159265 * (float(at.texel.y) + at.fraction.y) / size.y);
    vec4 j = limited(jacobian(f), most, max(across, 1e-3));
    return Parallelogram(j.xz, j.yw);
}

Ellipse ellipse(Parallelogram f) {
    return ellipse_of(jacobian(f), determinant_of(f), float(MAX_ANISOTROPY));
}

// The largest half side of an ellipse's bounding box, without K, in texels of the ellipse's level. Up to this size, all
// texels of the ellipse are at most half a tile away from the pixel's texel. The reconstruction term is at most K. Let
// h be the half side with K. `outer` adds the half texel of the edge. The squared half side is then at most
// (1 + 1/t) h^2 + (1 + t) / 4 with t = 2 sqrt(K), because the minor semi-axis is at least sqrt(K) (`k_at`). For a small
// K this bound is useless. The ratio r of the axes then gives 2 h / r <= t <= 2 h, so the squared half side is at most
// h^2 + h (r + 1) / 2 + 1/4.
float max_reach() {
    float t = 2.0 * sqrt(K), most = float(1u << TILE_LOG2 >> 1) - 0.5;
    if (K >= 0.25) return sqrt((most * most - 0.25 * (1.0 + t)) / (1.0 + 1.0 / t) - K);
    if (EDGE == 0) return sqrt(most * most / 1.0001 - K);
    float c = 0.25 * (float(MAX_ANISOTROPY) + 1.0), h = sqrt(c * c + most * most - 0.25) - c;
    return sqrt(h * h - K);
}

// The largest half side for the other filters of paper 3: half a tile, minus the 3 texels around a sample
// (baseline_half_sides).
float max_line() { return float(1u << TILE_LOG2 >> 1) - 3.0; }

// The level of a filter of paper 3, which may be one of the resident levels (G1). The fraction is the weight of the
// next coarser level.
float asked_level(Parallelogram f) {
    uint coarsest = max(WIDTH_LOG2, HEIGHT_LOG2);
    if (FILTER == ELLIPSE) return float(ellipse_level(ellipse(f), max_reach(), coarsest));
    return baseline_level(jacobian(f), determinant_of(f), max_line(), coarsest);
}

bool finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }

// Squared lengths of the longer and the shorter side.
vec2 squared_sides(Parallelogram f) {
    float a = dot(f.r1, f.r1), b = dot(f.r2, f.r2);
    // min and max are not used, because their result for NaN is undefined. If one side is not finite, both are NaN.
    return !(finite(a) && finite(b)) ? vec2(uintBitsToFloat(0x7fc00000u)) : a > b ? vec2(a, b) : vec2(b, a);
}

// nA: the number of samples along the longer side.
float sample_count(vec2 sides) {
    if (MAX_ANISOTROPY == 1) return 1.0;  // a specialization constant: removes the square root and the division
    float most = float(MAX_ANISOTROPY);
    return sides.y > 0.0 ? min(ceil(sqrt(sides.x / sides.y)), most) : most;
}

// The level q = clamp(floor(e), 0, L-L'+1) with e = log2(dmax / nA). The floor of log2(x) / 2 comes from the exponent
// of x, which is exact; a rounded log2 could be wrong at powers of two.
uint level(Parallelogram f) {
    if (is_of_paper_3()) return min(uint(asked_level(f)), FIRST_RESIDENT_LEVEL);
    vec2 sides = squared_sides(f);
    if (!finite(sides.x)) return FIRST_RESIDENT_LEVEL;
    if (sides.x == 0.0) return 0;
    float n = sample_count(sides);
    // A division may err by 2.5 ulp. Without anisotropy there is no division, and q is exact.
    float squared = MAX_ANISOTROPY == 1 ? sides.x : sides.x / (n * n);
    int exponent = int(floatBitsToUint(squared) >> 23) - 127;
    return uint(clamp(exponent >> 1, 0, int(FIRST_RESIDENT_LEVEL)));
}

// The coordinate in texels of level q, relative to the payload of its tile.
Spot spot_in_tile(Coordinate at, uvec2 ij, uint q) {
    ivec2 base = at.texel >> int(q);
    vec2 within = (vec2(at.texel - (base << int(q))) + at.fraction) * power_of_half(q);
    return Spot(base - (ivec2(ij.yx >> q) << int(TILE_LOG2)), within);
}

// The footprint's longer side.
vec2 major_side(Parallelogram f) { return dot(f.r1, f.r1) > dot(f.r2, f.r2) ? f.r1 : f.r2; }

// How far beyond its payload a tile can serve a sample, in texels: the border minus one, because a bilinear sample also
// reads the next texel.
int sample_margin() { return max(int(BORDER), 1) - 1; }

// True if a texel, relative to a tile's payload, is more than `margin` texels beyond the payload.
bool outside(ivec2 texel, int margin) {
    return any(lessThan(texel, ivec2(-margin))) || any(greaterThanEqual(texel, ivec2((1 << int(TILE_LOG2)) + margin)));
}

// The neighbouring tiles from which a pixel's filter reads texels (reach.glsl); none if the border has all these
// texels.
uint filter_reach(Coordinate at, uvec2 ij, Parallelogram f, uint q) {
    if (REACHES == 0 || q >= FIRST_RESIDENT_LEVEL) return 0u;
    Spot spot = spot_in_tile(at, ij, q);
    ivec2 first, last;  // texels of the ellipse, or the texels that contain samples
    int margin;
    if (FILTER == ELLIPSE) {
        Ellipse own = at_level(ellipse(f), q);
        // An ellipse without area reads one texel, the pixel's own.
        vec2 half_sides = own.det > 0.0 ? sqrt(outer(own).v.xz) : vec2(0.0);
        first = spot.texel + ivec2(ceil(spot.within - 0.5 - half_sides));
        last = spot.texel + ivec2(floor(spot.within - 0.5 + half_sides));
        margin = int(BORDER);
    } else if (is_of_paper_3()) {
        vec2 half_sides = baseline_half_sides(jacobian(f), determinant_of(f), max_line(), q);
        first = spot.texel + ivec2(floor(spot.within - half_sides));
        last = spot.texel + ivec2(floor(spot.within + half_sides));
        // The border of the next coarser level is half of the tile's own border, rounded down at the tile's far edges.
        margin = int(reads_two_levels() ? BORDER & ~1u : BORDER);
    } else {
        vec2 half_sides = abs(major_side(f)) * ((0.5 - 0.5 / sample_count(squared_sides(f))) * power_of_half(q));
        first = spot.texel + ivec2(floor(spot.within - half_sides));
        last = spot.texel + ivec2(floor(spot.within + half_sides));
        margin = sample_margin();
    }
    int side = 1 << int(TILE_LOG2);
    if (all(greaterThanEqual(first, ivec2(-margin))) && all(lessThan(last, ivec2(side + margin)))) return 0u;
    uvec2 before = 2u * uvec2(lessThan(first, ivec2(0))), after = uvec2(greaterThanEqual(last, ivec2(side)));
    uvec2 axes = max(before, after);
    return axes.x | axes.y << 2;
}
