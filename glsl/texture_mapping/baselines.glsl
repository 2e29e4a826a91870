// Published filters of a pixel (src/paper/texture_mapping/baselines.rs). Needs baseline_level.glsl, weights.glsl,
// common/hash.glsl and the texture around the pixel: `vec3 texel(ivec2 at, uint level)`, `Spot spot_at(uint level)` and
// `vec3 trilinear(vec2 offset, float level)`, with an offset in texels of level 0. Each filter sums differences from
// its first texel or sample, so that a constant texture gives its exact value.

vec3 line_mean(Line along, float level, uint most) {
    vec3 sum = vec3(0.0);
    vec3 first = vec3(0.0);
    float weights = 0.0;
    uint probes = along.taps * along.samples_a_tap;
    for (uint n = 0; n < probes && n < most * SAMPLES_A_TAP; ++n) {
        float tap = float(n / along.samples_a_tap);
        float part = 2.0 * (float(n) + 0.5) / float(probes) - 1.0;
        float tap_part = 2.0 * (tap + 0.5) / float(along.taps) - 1.0;
        if (along.to_the_ends) part = tap_part = probes > 1 ? 2.0 * float(n) / float(probes - 1) - 1.0 : 0.0;
        float w = exp(-along.fall * tap_part * tap_part);
        vec3 value = trilinear(part * along.reach, level);
        if (n == 0) first = value;
        sum += w * (value - first);
        weights += w;
    }
    return first + sum / weights;
}

// exp(-2 r^2) - exp(-2) at one of 128 steps of r^2.
float pbrt_weight(float r2) {
    const float entries = 128.0;
    return exp(-2.0 * min(floor(r2 * entries), entries - 1.0) / (entries - 1.0)) - exp(-2.0);
}

struct PbrtMean {
    vec3 colour;
    uint fetched;
};

// The mean of one level. A repeating texture has one texel from level `coarsest` on.
PbrtMean pbrt_of_level(PbrtAxes axes, uint level, uint coarsest) {
    const int max_turns = 64;
    if (level >= coarsest) return PbrtMean(texel(spot_at(coarsest).texel, coarsest), 1);
    Spot spot = spot_at(level);
    vec2 offset = spot.within - 0.5;
    vec2 longer = axes.longer * power_of_half(level), shorter = axes.shorter * power_of_half(level);
    float a = longer.y * longer.y + shorter.y * shorter.y + 1.0;
    float b = -2.0 * (longer.x * longer.y + shorter.x * shorter.y);
    float c = longer.x * longer.x + shorter.x * shorter.x + 1.0;
    float f = a * c - 0.25 * b * b;
    vec2 reach = sqrt(vec2(c, a));
    ivec2 low = ivec2(ceil(offset - reach));
    ivec2 high = ivec2(floor(offset + reach));
    vec3 sum = vec3(0.0);
    vec3 first = vec3(0.0);
    float weights = 0.0;
    uint fetched = 0;
    for (int row = low.y; row <= high.y && row < low.y + max_turns; ++row) {
        for (int column = low.x; column <= high.x && column < low.x + max_turns; ++column) {
            vec2 d = vec2(column, row) - offset;
            float r2 = (a * d.x * d.x + b * d.x * d.y + c * d.y * d.y) / f;
            if (r2 < 1.0) {
                vec3 value = texel(spot.texel + ivec2(column, row), level);
                float w = pbrt_weight(r2);
                if (fetched == 0) first = value;
                sum += w * (value - first);
                weights += w;
                ++fetched;
            }
        }
    }
    return PbrtMean(weights > 0.0 ? first + sum / weights : texel(spot.texel, level), fetched);
}

// `part` is the weight of level + 1.
PbrtMean pbrt_mean(PbrtAxes axes, uint level, float part, uint coarsest) {
    PbrtMean finer = pbrt_of_level(axes, level, coarsest);
    PbrtMean coarser = pbrt_of_level(axes, level + 1, coarsest);
    // mix() would not return equal colours exactly.
    vec3 colour = finer.colour + (coarser.colour - finer.colour) * part;
    return PbrtMean(colour, finer.fetched + coarser.fetched);
}

// Random single texels (Pharr, Wronski, Salvi and Fajardo, "Filtering after shading with stochastic texture filtering",
// I3D 2024). The truncated Gaussian selects a position in the footprint; the bilinear weights select one of the four
// texels around this position. `seed`: pixel and frame.
vec3 ellipse_taps_mean(vec4 jacobian, uint level, uint samples, uvec3 seed) {
    float half_power = power_of_half(level);
    Spot spot = spot_at(level);
    vec3 sum = vec3(0.0);
    vec3 first = vec3(0.0);
    for (uint n = 0; n < samples; ++n) {
        vec4 unit = vec4(hash(uvec4(seed.xy, n, seed.z)) >> 8) * power_of_half(24);
        float radius = sqrt(-log(1.0 - unit.x * (1.0 - exp(-ALPHA))) / ALPHA);
        float angle = 6.2831853 * unit.y;
        vec2 in_disc = radius * vec2(cos(angle), sin(angle));
        vec2 moved = vec2(dot(jacobian.xy, in_disc), dot(jacobian.zw, in_disc));
        vec2 at = spot.within + moved * half_power - 0.5 + unit.zw;
        vec3 value = texel(spot.texel + ivec2(floor(at)), level);
        if (n == 0) first = value;
        sum += value - first;
    }
    return first + sum / float(samples);
}
