// Paper 3's filters of a surface. Needs form.glsl, surface_filter_level.glsl, weights.glsl, and the texture around the
// pixel: `vec3 texel(ivec2 at, uint level)` and `Spot spot_at(uint level)`.
#if WEIGHT_MAP
#define MAP_BINDING 5
#include "texture_mapping/weight_map.glsl"
#else
float weight(vec2 at) { return gaussian(at); }
#endif
#include "texture_mapping/ellipse.glsl"

// A bilinear sample of a level, from single texels.
vec3 bilinear(vec2 offset, uint level) {
    Spot spot = spot_at(level);
    vec2 at = spot.within + offset * power_of_half(level) - 0.5;
    vec2 part = at - floor(at);
    ivec2 first = spot.texel + ivec2(floor(at));
    vec3 a = texel(first, level), b = texel(first + ivec2(1, 0), level);
    vec3 c = texel(first + ivec2(0, 1), level), d = texel(first + ivec2(1, 1), level);
    // mix() would not return equal colours exactly.
    vec3 above = a + part.x * (b - a), below = c + part.x * (d - c);
    return above + part.y * (below - above);
}

vec3 trilinear(vec2 offset, float level) {
    uint finer = uint(level);
    vec3 colour = bilinear(offset, finer);
    // A loop instead of a branch, because software drivers run both sides of a branch.
    for (bool mixes = level > float(finer); mixes; mixes = false)
        colour += (level - float(finer)) * (bilinear(offset, finer + 1) - colour);
    return colour;
}

#include "texture_mapping/baselines.glsl"

// The mean of `level`, and of the next coarser level with the weight `part`. `seed`: pixel and frame, for random taps.
vec3 baseline_mean(vec4 jacobian, float det, float max_reach, uint level, float part, uint coarsest, uvec3 seed) {
    if (level >= coarsest) return texel(spot_at(coarsest).texel, coarsest);
    if (FILTER == PBRT) return pbrt_mean(pbrt_axes(jacobian, max_reach), level, part, coarsest).colour;
    if (FILTER == ELLIPSE_TAPS) return ellipse_taps_mean(jacobian, level, SAMPLES, seed);
    return line_mean(line_of(jacobian, det, max_reach), float(level) + part, MAX_ANISOTROPY);
}
