#version 460
// variants DUMP: 0 1
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/plane.glsl"
#include "texture_mapping/filtered.glsl"
#include "texture_mapping/footprint.glsl"

// Filters that take trilinear samples along a line (src/paper/texture_mapping/baselines.rs).
layout(constant_id = 1) const uint RULE = 0;  // 0: trilinear; 1: anisotropic; 2: Feline; 3: Mavridis and Papaioannou
layout(constant_id = 2) const uint MOST = 1;  // samples, probes or taps

const uint SAMPLES_A_TAP = 16;

struct Line {
    vec2 reach;  // texels from the middle of the line to its end
    uint taps;
    uint samples_a_tap;
    float level;
    float fall;  // a tap at t * reach, t from -1 to 1, has the weight exp(-fall t^2)
    bool to_the_ends;  // the first and last probe are at the ends; else probes are in the middle of equal parts
};

// Major and minor semi-axis of the ellipse r <= 1, and the direction of the major one.
vec4 axes_of(Pixel pixel) {
    vec3 v = spread(pixel.jacobian);
    vec2 values = eigenvalues(v, pixel.det * pixel.det);
    vec2 a = vec2(v.y, values.x - v.x);
    vec2 b = vec2(values.x - v.z, v.y);
    vec2 direction = dot(a, a) > dot(b, b) ? a : b;
    direction = dot(direction, direction) > 0.0 ? normalize(direction) : vec2(1.0, 0.0);
    return vec4(sqrt(values), direction);
}

Line line_of(Pixel pixel) {
    vec2 right = pixel.jacobian.xz;
    vec2 down = pixel.jacobian.yw;
    float longer = max(length(right), length(down));
    float shorter = min(length(right), length(down));
    vec2 along = length(right) > length(down) ? right : down;
    if (RULE == 0) return Line(vec2(0.0), 1, 1, log2(longer), 0.0, false);
    if (RULE == 1) {
        uint count = uint(clamp(ceil(longer / shorter), 1.0, float(MOST)));
        return Line(0.5 * along, count, 1, log2(longer / float(count)), 0.0, false);
    }
    vec4 axes = axes_of(pixel);
    if (RULE == 2) {
        uint probes = uint(clamp(floor(2.0 * axes.x / axes.y - 0.5), 1.0, float(MOST)));
        float minor = max(axes.y, 2.0 * axes.x / float(probes + 1));
        float reach = max(axes.x - minor, 0.0);
        float part = reach / axes.x;
        return Line(reach * axes.zw, probes, 1, log2(minor), 2.0 * part * part, true);
    }
    float tap = 2.0 * axes.x / float(MOST);
    uint samples = uint(clamp(ceil(tap / axes.y), 1.0, float(SAMPLES_A_TAP)));
    return Line(axes.x * axes.zw, MOST, samples, log2(max(axes.y, tap / float(samples))), 2.0, false);
}

void main() {
    Pixel pixel = pixel_at(gl_FragCoord.xy);
    if (!pixel.seen) {
        store(pixel, Filtered(vec3(0.0), 0, 0, false, 0));
        return;
    }
    Line along = line_of(pixel);
    float level = clamp(along.level, 0.0, float(COARSEST));
    float side = float(1u << COARSEST);
    vec3 sum = vec3(0.0);
    vec3 first = vec3(0.0);
    float weights = 0.0;
    uint probes = along.taps * along.samples_a_tap;
    for (uint n = 0; n < probes && n < MOST * SAMPLES_A_TAP; ++n) {
        float tap = float(n / along.samples_a_tap);
        float part = 2.0 * (float(n) + 0.5) / float(probes) - 1.0;
        float tap_part = 2.0 * (tap + 0.5) / float(along.taps) - 1.0;
        if (along.to_the_ends) part = tap_part = probes > 1 ? 2.0 * float(n) / float(probes - 1) - 1.0 : 0.0;
        float w = exp(-along.fall * tap_part * tap_part);
        vec3 value = textureLod(texture_of, (pixel.centre + part * along.reach) / side, level).rgb;
        if (n == 0) first = value;
        sum += w * (value - first);
        weights += w;
    }
    // A probe takes 4 texels within a level, 8 between two levels.
    uint texels = level > 0.0 && level < float(COARSEST) ? 8 : 4;
    store(pixel, Filtered(first + sum / weights, texels * probes, uint(level), false, texels * probes));
}
