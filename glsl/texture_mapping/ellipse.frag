#version 460
// variants DUMP: 0 1
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/plane.glsl"
#include "texture_mapping/filtered.glsl"
#include "texture_mapping/footprint.glsl"
#include "texture_mapping/weights.glsl"
#include "texture_mapping/ellipse.glsl"

void main() {
    Pixel pixel = pixel_at(gl_FragCoord.xy);
    if (pixel.seen) {
        store(pixel, ellipse_filtered(pixel));
    } else {
        store(pixel, Filtered(vec3(0.0), 0, 0, false, 0));
    }
}
