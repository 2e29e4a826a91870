#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/coordinates.glsl"

// 1: the rasteriser divides by w; 0: it interpolates (u w, v w, w) linearly over the screen.
layout(constant_id = 2) const uint PERSPECTIVE = 0;

layout(location = 0) out vec3 terms;

// Two triangles over the whole band.
void main() {
    uint corner = uint[](0u, 2u, 1u, 1u, 2u, 3u)[gl_VertexIndex];
    vec2 at = vec2(corner & 1u, corner >> 1);
    vec3 homogeneous = band.plane * vec3(at * vec2(band.size) + vec2(0.0, band.first_row), 1.0);
    // The homography's denominator is the inverse of clip space's w.
    float w = PERSPECTIVE == 1u ? 1.0 / homogeneous.z : 1.0;
    gl_Position = vec4(at * 2.0 - 1.0, 0.5, 1.0) * w;
    terms = homogeneous * w;
}
