#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/object_space.glsl"

// Stage 5: a pixel is the weighted mean of its fragments; black if it has none.
layout(binding = 2, scalar) readonly buffer Counts { uint fragments; uint depth_tests; uint sums; } counts;
layout(binding = 6, scalar) readonly buffer Sums { uvec4 of[]; } sums;
layout(location = 0) out vec4 colour;  // alpha: texels fetched per pixel, averaged over the picture

void main() {
    uvec4 own = sums.of[uint(gl_FragCoord.y) * object.size.x + uint(gl_FragCoord.x)];
    uint weight = max(own.x, 1u);
    // Divides whole bytes and the remainder separately, so that a constant colour stays exact.
    uvec3 bytes = own.yzw / weight;
    vec3 mean = (vec3(bytes) + vec3(own.yzw - bytes * weight) / float(weight)) / 255.0;
    colour = vec4(mean, 4.0 * float(counts.fragments) / float(object.size.x * object.size.y));
}
