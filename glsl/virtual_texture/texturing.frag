#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"
#include "virtual_texture/view.glsl"
#include "virtual_texture/resident.glsl"

layout(constant_id = 9) const uint LITERAL_INTERPOLATION = 0;  // 1: C1 f + C2 (1 - f), as printed
layout(constant_id = 16) const uint FADE_IN = 0;                // 1: tiles that arrive are mixed in over some frames

layout(binding = 2) uniform sampler2DArray j1;  // mip 0: the tile's level, mip 1: its next coarser

layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
layout(location = 0) out vec4 colour;  // linear light

// The mean of nA samples spread along the footprint's longer side; each one interpolates two levels.
vec4 sample_tile(Resident tile, vec2 texels, vec2 major, float count, float f) {
    float side = float((1u << TILE_LOG2) + 2 * BORDER);
    vec2 centre = (texels + float(BORDER)) / side;
    float lod = LITERAL_INTERPOLATION == 1 ? 1.0 - f : f;
    if (MAX_ANISOTROPY == 1) return textureLod(j1, vec3(centre, tile.slot), lod);
    vec2 reach = major * power_of_half(tile.level) / side;
    vec4 sum = vec4(0.0);
    for (float n = 0.5; n < count; n++)
        sum += textureLod(j1, vec3(centre + (n / count - 0.5) * reach, tile.slot), lod);
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

    // A streamed level is stage 1's; inside G1 the unclamped e counts.
    float biased = e + float(view.level_bias);
    uint q = min(qij.x + view.level_bias, FIRST_RESIDENT_LEVEL);
    if (q == FIRST_RESIDENT_LEVEL)
        q = uint(clamp(biased, float(q), float(max(WIDTH_LOG2, HEIGHT_LOG2))));
    // A tile that fades in leaves the rest of its weight to what was shown before it: the next coarser one in J1.
    colour = vec4(0.0);
    float weight = 1.0;
    uint from = q;
    do {
        Resident tile = find_resident(from, qij.yz);
        // Magnification (e < 0) and a coarser stand-in (q' > q) both show one level alone.
        float fraction = tile.level == q ? clamp(biased - float(q), 0.0, 1.0) : 0.0;
        float rest = FADE_IN == 1 ? weight * tile.fade : 0.0;
        // One sample for whatever level: software drivers run both sides of a branch.
        colour += (weight - rest) * sample_tile(tile, texels_in_tile(at, qij.yz, tile.level), major, count, fraction);
        weight = rest;
        from = tile.level + 1;
    } while (FADE_IN == 1 && weight > 0.0);
}
