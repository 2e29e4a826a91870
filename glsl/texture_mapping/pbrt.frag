#version 460
// variants DUMP: 0 1
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/plane.glsl"
#include "texture_mapping/filtered.glsl"

// pbrt-v4's MIPMap::EWA (Pharr, Jakob and Humphreys, "Physically based rendering", 4th edition, section 10.4.5), with a
// repeating texture.
const float MOST_RATIO = 8.0;
const float TABLE_ENTRIES = 128.0;
const int MOST_TURNS = 64;

// exp(-2 r^2) - exp(-2) at one of 128 steps of r^2.
float table(float r2) {
    return exp(-2.0 * min(floor(r2 * TABLE_ENTRIES), TABLE_ENTRIES - 1.0) / (TABLE_ENTRIES - 1.0)) - exp(-2.0);
}

struct Level {
    vec3 colour;
    uint fetched;
};

Level of_level(Pixel pixel, vec2 longer, vec2 shorter, uint level) {
    if (level >= COARSEST) return Level(texel(ivec2(0), COARSEST), 1);
    float half_power = power_of_half(level);
    vec2 centre = pixel.centre * half_power;
    ivec2 base = ivec2(floor(centre));
    vec2 offset = centre - floor(centre) - 0.5;
    longer *= half_power;
    shorter *= half_power;
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
    for (int row = low.y; row <= high.y && row < low.y + MOST_TURNS; ++row) {
        for (int column = low.x; column <= high.x && column < low.x + MOST_TURNS; ++column) {
            vec2 d = vec2(column, row) - offset;
            float r2 = (a * d.x * d.x + b * d.x * d.y + c * d.y * d.y) / f;
            if (r2 < 1.0) {
                vec3 value = texel(base + ivec2(column, row), level);
                float w = table(r2);
                if (fetched == 0) first = value;
                sum += w * (value - first);
                weights += w;
                ++fetched;
            }
        }
    }
    return Level(weights > 0.0 ? first + sum / weights : texel(base, level), fetched);
}

void main() {
    Pixel pixel = pixel_at(gl_FragCoord.xy);
    vec2 longer = pixel.jacobian.xz;
    vec2 shorter = pixel.jacobian.yw;
    if (dot(longer, longer) < dot(shorter, shorter)) {
        vec2 other = longer;
        longer = shorter;
        shorter = other;
    }
    float most = length(longer);
    float least = length(shorter);
    if (least * MOST_RATIO < most && least > 0.0) {
        shorter *= most / (least * MOST_RATIO);
        least = most / MOST_RATIO;
    }
    float lod = clamp(log2(max(least, 1e-30)), 0.0, float(COARSEST));
    uint level = uint(lod);
    Level finer = of_level(pixel, longer, shorter, level);
    Level coarser = of_level(pixel, longer, shorter, level + 1);
    uint fetched = finer.fetched + coarser.fetched;
    // mix() would not return equal colours exactly.
    vec3 value = finer.colour + (coarser.colour - finer.colour) * (lod - float(level));
    store(pixel, Filtered(value, fetched, level, false, fetched));
}
