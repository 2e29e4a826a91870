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

// pbrt-v4's MIPMap::EWA with a repeating texture.
void main() {
    here = pixel_at(gl_FragCoord.xy);
    PbrtAxes axes = pbrt_axes(here.jacobian, ANY_REACH);
    float lod = clamp(axes.level, 0.0, float(COARSEST));
    uint level = uint(lod);
    PbrtMean mean = pbrt_mean(axes, level, lod - float(level), COARSEST);
    store(here, Filtered(mean.colour, mean.fetched, level, false, mean.fetched));
}
