// Texture coordinates and their derivatives from a row's constants: coordinates/mod.rs has the formulas.

// The values written for a pixel: the index of the variant of `Output`.
layout(constant_id = 0) const uint OUTPUT = 0;
const uint TEXEL = 0, TERMS = 1, COORDINATES = 2, DERIVATIVES = 3;

// The index of the variant of `DerivativeMethod`.
layout(constant_id = 1) const uint DERIVATIVE_METHOD = 0;
const uint DIFFERENCES = 0, INCREMENTAL = 1, ANALYTIC = 2;

layout(binding = 0) uniform sampler2D image;

layout(push_constant, scalar) uniform PlaneBand {
    mat3 plane;      // columns of the homography: (A D G), (B E H), (C F I)
    uvec2 size;      // pixels
    uint first_row;  // of the band in the picture
    float to_unit;   // texels to [0, 1]
    uint lanes;      // threads per row (compute only)
    uint run;        // pixels per thread of a walk with restarts (compute only)
} band;

#include "texture_mapping/coordinates_row.glsl"

// (du/dx, dv/dx, du/dy, dv/dy) from a pixel's numerators and denominator.
vec4 derivatives(RowConstants row, vec2 dy, float w) {
    precise vec2 below =
        DERIVATIVE_METHOD == ANALYTIC ? vec2(w * w) : vec2(w * (w + band.plane[0].z), w * (w + band.plane[1].z));
    return vec4(row.dx / below.x, dy / below.y);
}

// The words of a pixel; `terms` are u w, v w and w.
uvec4 words(vec3 terms) {
    if (OUTPUT == TERMS) return uvec4(floatBitsToUint(terms), 0u);
    precise vec2 texels = terms.xy / terms.z;
    if (OUTPUT == COORDINATES) return uvec4(floatBitsToUint(texels), 0u, 0u);
    return uvec4(packUnorm4x8(textureLod(image, texels * band.to_unit, 0.0)), 0u, 0u, 0u);
}
