#version 460
// variants DUMP: 0 1
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "common/hash.glsl"
#include "texture_mapping/plane.glsl"
#include "texture_mapping/filtered.glsl"
#include "texture_mapping/footprint.glsl"
#include "texture_mapping/weights.glsl"
#include "texture_mapping/at_pixel.glsl"
#include "texture_mapping/baseline_level.glsl"
#include "texture_mapping/baselines.glsl"

// Filters that take trilinear samples along a line.
layout(constant_id = 1) const uint RULE = 0;  // of line_of
layout(constant_id = 2) const uint MAX = 1;  // samples, probes or taps

void main() {
    here = pixel_at(gl_FragCoord.xy);
    if (!here.seen) {
        store(here, Filtered(vec3(0.0), 0, 0, false, 0));
        return;
    }
    Line along = line_of(RULE, MAX, here.jacobian, here.det, ANY_REACH);
    float level = clamp(along.level, 0.0, float(COARSEST));
    // A probe takes 4 texels within a level, 8 between two levels.
    uint texels = (level > 0.0 && level < float(COARSEST) ? 8 : 4) * along.taps * along.samples_a_tap;
    store(here, Filtered(line_mean(along, level, MAX), texels, uint(level), false, texels));
}
