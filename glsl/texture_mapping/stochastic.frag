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

// Random single texels of the ellipse.
layout(constant_id = 1) const uint SAMPLES = 1;

void main() {
    here = pixel_at(gl_FragCoord.xy);
    uint level = uint(clamp(ellipse_taps_level(here.jacobian, here.det, ANY_REACH), 0.0, float(COARSEST)));
    vec3 mean = ellipse_taps_mean(here.jacobian, level, SAMPLES, uvec3(gl_FragCoord.xy, plane.frame));
    store(here, Filtered(mean, SAMPLES, level, false, SAMPLES));
}
