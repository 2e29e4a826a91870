#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/coordinates.glsl"
#include "texture_mapping/coordinates_walk.glsl"

// 1: a thread reads its row's constants; 0: it computes them from the nine coefficients.
layout(constant_id = 3) const uint ROW_CONSTANTS = 0;

layout(binding = 1, scalar) readonly buffer Rows { RowConstants rows[]; } set_up;

// Computes each pixel from the row's constants with one fma per value, so no error accumulates along the row.
void main() {
    ThreadPixels own = walk();
    if (own.count == 0u) return;
    vec3 row;
    float x = float(own.first);
    if (ROW_CONSTANTS == 1u) {
        row = set_up.rows[own.row].start;
    } else {
        precise vec3 of_row = band.plane[1] * (float(band.first_row + own.row) + 0.5) + band.plane[2];
        row = of_row;
        x += 0.5;
    }
    for (uint n = 0; n < own.count; n++) {
        precise vec3 terms = fma(band.plane[0], vec3(x), row);
        store(own, n, words(terms));
        x += float(own.stride);
    }
}
