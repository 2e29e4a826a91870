#version 460
// variants DUMP: 0 1
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/plane.glsl"
#include "texture_mapping/filtered.glsl"

// Crow, "Summed-area tables for texture mapping" (SIGGRAPH 1984): the mean of the footprint's bounding box, in whole texels.
// Sums are of the texture's bytes, over 2 x 2 copies of it, so that a box needs no wrapping: exact in 32 bits, and modulo 2^32 where
// they overflow.
layout(binding = 2) uniform utexture2D sums;

void main() {
    Pixel pixel = pixel_at(gl_FragCoord.xy);
    int side = 1 << int(COARSEST);
    vec2 reach = 0.5 * (abs(pixel.jacobian.xz) + abs(pixel.jacobian.yw));
    vec2 low = floor(pixel.centre - reach + 0.5);
    vec2 size = clamp(floor(pixel.centre + reach + 0.5) - low, vec2(1.0), vec2(side));
    ivec2 from = ivec2(low) & (side - 1);
    ivec2 to = from + ivec2(size);
    uvec3 sum = texelFetch(sums, to, 0).rgb - texelFetch(sums, ivec2(from.x, to.y), 0).rgb
              - texelFetch(sums, ivec2(to.x, from.y), 0).rgb + texelFetch(sums, from, 0).rgb;
    // Whole bytes and the rest apart: a constant texture comes out exactly.
    uint texels = uint(size.x) * uint(size.y);
    uvec3 bytes = sum / texels;
    vec3 mean = (vec3(bytes) + vec3(sum - bytes * texels) / float(texels)) / 255.0;
    store(pixel, Filtered(mean, 4, 0, false, 4));
}
