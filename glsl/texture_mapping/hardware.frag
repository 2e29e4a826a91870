#version 460
// variants DUMP: 0 1
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/plane.glsl"
#include "texture_mapping/filtered.glsl"

// The device's own sampler, with implicit derivatives.
void main() {
    Pixel pixel = pixel_at(gl_FragCoord.xy);
    vec3 value = texture(texture_of, pixel.centre / float(1u << COARSEST)).rgb;
    store(pixel, Filtered(value, 0, 0, false, 0));
}
