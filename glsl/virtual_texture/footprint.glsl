// Stage 1's arithmetic (paper 1, section 2.1): texture coordinate, footprint, level. Needs pyramid.glsl.
layout(constant_id = 5) const uint MAX_ANISOTROPY = 1;  // NA
layout(constant_id = 24) const uint PIXEL_LOG2 = 0;    // a pixel stands for 2^n x 2^n pixels of the picture

// A texel of level 0 and the place in it. f32 alone would hold 1/64 texel at 2^18 and 1/16 at 2^20.
struct Coordinate {
    ivec2 texel;
    vec2 fraction;  // [0, 1)
};

// 2^-n, exactly: exp2 may be off by some ulp.
float power_of_half(uint n) { return uintBitsToFloat((127u - n) << 23); }

// s = origin / 2^32 + offset. The origin's part is exact integer arithmetic, the offset is small.
Coordinate coordinate(uvec2 origin, vec2 offset) {
    uvec2 whole = uvec2(origin.x >> (32 - WIDTH_LOG2), origin.y >> (32 - HEIGHT_LOG2));
    uvec2 rest = uvec2(origin.x << WIDTH_LOG2, origin.y << HEIGHT_LOG2);  // in 2^-32 texel; 0 from 2^10 texels on
    vec2 texels = offset * vec2(1u << WIDTH_LOG2, 1u << HEIGHT_LOG2) + vec2(rest) * power_of_half(32);
    // 2^22 texels away lies outside every texture; a NaN may become any value, and the level rule keeps it out.
    vec2 steps = clamp(floor(texels), -4194304.0, 4194304.0);
    return Coordinate(ivec2(whole) + ivec2(steps), texels - steps);
}

// Row i and column j in M0, with the paper's clamps for t = 1 and s = 1.
uvec2 tile_row_column(Coordinate at) {
    ivec2 tile = clamp(at.texel >> int(TILE_LOG2), ivec2(0), ivec2(tile_grid()) - 1);
    return uvec2(tile.y, tile.x);
}

// The parallelogram's sides in texels of level 0.
struct Footprint {
    vec2 r1;  // (s_x, t_x)
    vec2 r2;  // (s_y, t_y)
};

Footprint footprint(vec2 dx, vec2 dy) {
    vec2 size = vec2(1u << WIDTH_LOG2, 1u << HEIGHT_LOG2);
    size *= power_of_half(PIXEL_LOG2);  // exact
    return Footprint(size * dx, size * dy);
}

bool finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }

// Squared lengths of the longer and the shorter side.
vec2 squared_sides(Footprint f) {
    float a = dot(f.r1, f.r1), b = dot(f.r2, f.r2);
    // Not min and max: their result for NaN is undefined, and one bad side must spoil both.
    return !(finite(a) && finite(b)) ? vec2(uintBitsToFloat(0x7fc00000u)) : a > b ? vec2(a, b) : vec2(b, a);
}

// nA: how many samples along the longer side.
float sample_count(vec2 sides) {
    if (MAX_ANISOTROPY == 1) return 1.0;  // folds at specialization: no square root, no division
    float most = float(MAX_ANISOTROPY);
    return sides.y > 0.0 ? min(ceil(sqrt(sides.x / sides.y)), most) : most;
}

// q = clamp(floor(e), 0, L-L'+1), e = log2(dmax / nA). floor(log2(x) / 2) is read off the exponent: exact,
// where a rounded log2 would flip at powers of two.
uint level(vec2 sides) {
    if (!finite(sides.x)) return FIRST_RESIDENT_LEVEL;
    if (sides.x == 0.0) return 0;
    float n = sample_count(sides);
    // A division may round by 2.5 ulp; without anisotropy there is none, and q is exact.
    float squared = MAX_ANISOTROPY == 1 ? sides.x : sides.x / (n * n);
    int exponent = int(floatBitsToUint(squared) >> 23) - 127;
    return uint(clamp(exponent >> 1, 0, int(FIRST_RESIDENT_LEVEL)));
}
