#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/coordinates.glsl"
#include "texture_mapping/coordinates_walk.glsl"

layout(binding = 1, scalar) readonly buffer Rows { RowConstants rows[]; } set_up;

// Increments by formulas (7) and (8): one addition per pixel for each numerator and for the denominator.
void main() {
    ThreadPixels own = walk();
    if (own.count == 0u) return;
    RowConstants row = set_up.rows[own.row];
    precise vec3 terms = fma(band.plane[0], vec3(own.first), row.start);
    precise vec2 dy = fma(row.dy_step, vec2(own.first), row.dy);
    vec3 step = band.plane[0] * float(own.stride);
    vec2 dy_step = row.dy_step * float(own.stride);
    for (uint n = 0; n < own.count; n++) {
        store(own, n, OUTPUT == DERIVATIVES ? floatBitsToUint(derivatives(row, dy, terms.z)) : words(terms));
        terms += step;
        dy += dy_step;
    }
}
