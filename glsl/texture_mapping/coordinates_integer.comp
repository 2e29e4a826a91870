#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "common/extensions.glsl"
#include "texture_mapping/coordinates.glsl"
#include "texture_mapping/coordinates_walk.glsl"

struct IntegerRow {
    int64_t start[3];
    int64_t step[3];
};

layout(binding = 1, scalar) readonly buffer Rows { IntegerRow rows[]; } set_up;

// Increments by formulas (7) and (8), with integers. The sums are exact. The step is rounded when the row is set up;
// only this error grows along the row.
void main() {
    ThreadPixels own = walk();
    if (own.count == 0u) return;
    int64_t terms[3], step[3];
    for (uint c = 0; c < 3u; c++) {
        step[c] = set_up.rows[own.row].step[c];
        terms[c] = set_up.rows[own.row].start[c] + step[c] * int64_t(own.first);
        step[c] *= int64_t(own.stride);
    }
    for (uint n = 0; n < own.count; n++) {
        store(own, n, words(vec3(terms[0], terms[1], terms[2])));
        for (uint c = 0; c < 3u; c++) terms[c] += step[c];
    }
}
