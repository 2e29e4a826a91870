#version 460
// variants DUMP: 0 1
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/plane.glsl"
#include "texture_mapping/filtered.glsl"

// Crow, "Summed-area tables for texture mapping" (SIGGRAPH 1984): the mean of the footprint's bounding box, in whole
// texels. The table sums bytes over 2 x 2 copies of the texture, so that a box needs no wrapping. Sums are modulo
// 2^32; a box's sum fits 32 bits and is exact.
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
    // Divides whole bytes and the remainder separately, so that a constant texture stays exact.
    uint texels = uint(size.x) * uint(size.y);
    uvec3 bytes = sum / texels;
    vec3 mean = (vec3(bytes) + vec3(sum - bytes * texels) / float(texels)) / 255.0;
    store(pixel, Filtered(mean, 4, 0, false, 4));
}
