#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"
#include "virtual_texture/view.glsl"
#include "virtual_texture/resident.glsl"

layout(constant_id = 9) const uint LITERAL_INTERPOLATION = 0;  // 1: C1 f + C2 (1 - f), as printed

layout(binding = 2) uniform sampler2DArray j1;  // mip 0: the tile's level, mip 1: its next coarser
layout(binding = 3) uniform sampler2D g1;       // levels L-L'+1 .. L

layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
layout(location = 0) out vec4 colour;  // linear light

// The mean of nA samples spread along the footprint's longer side; each one interpolates two levels.
vec4 sample_tile(Resident tile, vec2 texels, vec2 major, float count, float f) {
    float side = float((1u << TILE_LOG2) + 2 * BORDER);
    vec2 centre = (texels + float(BORDER)) / side;
    float lod = LITERAL_INTERPOLATION == 1 ? 1.0 - f : f;
    if (MAX_ANISOTROPY == 1) return textureLod(j1, vec3(centre, tile.slot), lod);
    vec2 reach = major * exp2(-float(tile.level)) / side;
    vec4 sum = vec4(0.0);
    for (float n = 0.5; n < count; n++)
        sum += textureLod(j1, vec3(centre + (n / count - 0.5) * reach, tile.slot), lod);
    return sum / count;
}

// One level of G1. Beyond a pole's row of texel centres comes the same row half a turn away, as the tiles' borders
// have it; the sampler, which clamps there, would show a star around the pole.
vec4 sample_level(vec2 st, float level) {
    vec4 here = textureLod(g1, st, level);
    float rows = max(exp2(float(HEIGHT_LOG2) - float(FIRST_RESIDENT_LEVEL) - level), 1.0);
    float row = st.y * rows - 0.5;
    float beyond = max(-row, row - (rows - 1.0));
    if (beyond <= 0.0) return here;
    return mix(here, textureLod(g1, st + vec2(0.5, 0.0), level), min(beyond, 0.5));
}

vec4 sample_g1(vec2 st, float lod) {
    float last = float(max(WIDTH_LOG2, HEIGHT_LOG2) - FIRST_RESIDENT_LEVEL);
    lod = min(lod, last);
    // Half a row of the coarser of the two levels: nearer to a pole than that, each level mirrors by itself.
    float half_row = 0.5 * exp2(ceil(lod) + float(FIRST_RESIDENT_LEVEL) - float(HEIGHT_LOG2));
    if (min(st.y, 1.0 - st.y) >= half_row) return textureLod(g1, st, lod);
    return mix(sample_level(st, floor(lod)), sample_level(st, ceil(lod)), fract(lod));
}

vec4 sample_resident_levels(Coordinate at, vec2 major, float count, float lod) {
    vec2 size = vec2(1u << WIDTH_LOG2, 1u << HEIGHT_LOG2);
    vec2 st = (vec2(at.texel) + at.fraction) / size;
    if (MAX_ANISOTROPY == 1) return sample_g1(st, lod);
    vec4 sum = vec4(0.0);
    for (float n = 0.5; n < count; n++) sum += sample_g1(st + (n / count - 0.5) * major / size, lod);
    return sum / count;
}

void main() {
    // The tile is the one that stage 1 named, bit for bit: nothing is decided twice.
    uvec3 qij = load_triple(texelFetch(u1, ivec2(gl_FragCoord.xy), 0));
    Coordinate at = coordinate(triangle_origin, from_origin);
    Footprint f = footprint(dFdxFine(from_origin), dFdyFine(from_origin));
    vec2 sides = squared_sides(f);
    bool usable = finite(sides.x);
    float count = usable && sides.x > 0.0 ? sample_count(sides) : 1.0;
    vec2 major = usable ? (dot(f.r1, f.r1) > dot(f.r2, f.r2) ? f.r1 : f.r2) : vec2(0.0);
    // e may differ from stage 1's by an ulp of log2; q is stage 1's, so only f can feel it, and f is clamped.
    float e = usable && sides.x > 0.0 ? 0.5 * log2(sides.x / (count * count)) : float(qij.x);

    uint q = min(qij.x + view.level_bias, FIRST_RESIDENT_LEVEL);
    Resident tile = find_resident(q, qij.yz);
    if (tile.level == FIRST_RESIDENT_LEVEL) {
        // Inside G1 the unclamped e counts; where G1 stands in for a missing tile, its finest level.
        float lod = max(e + float(view.level_bias) - float(FIRST_RESIDENT_LEVEL), 0.0);
        colour = sample_resident_levels(at, major, count, lod);
        return;
    }
    // Magnification (e < 0) and a coarser stand-in (q' > q) both show one level alone.
    float fraction = tile.level == q ? clamp(e - float(qij.x), 0.0, 1.0) : 0.0;
    colour = sample_tile(tile, texels_in_tile(at, qij.yz, tile.level), major, count, fraction);
}
