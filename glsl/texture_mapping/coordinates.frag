#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/coordinates.glsl"

// 1: the row's constants from a buffer; 0: Heckbert's nine coefficients.
layout(constant_id = 2) const uint ROW_CONSTANTS = 0;

layout(binding = 1, scalar) readonly buffer Rows { RowConstants rows[]; } set_up;
layout(location = 0) out uvec4 pixel;

// u w, v w and w at a position in pixels.
vec3 textbook(vec2 at) {
    precise vec3 terms = band.plane[0] * at.x + band.plane[1] * at.y + band.plane[2];
    return terms;
}

vec2 texels(vec2 at) {
    vec3 terms = textbook(at);
    precise vec2 texels = terms.xy / terms.z;
    return texels;
}

void main() {
    vec2 at = gl_FragCoord.xy + vec2(0.0, band.first_row);
    if (ROW_CONSTANTS == 0u) {
        if (OUTPUT != DERIVATIVES) {
            pixel = words(textbook(at));
        } else {
            vec2 here = texels(at);
            precise vec4 steps = vec4(texels(at + vec2(1, 0)) - here, texels(at + vec2(0, 1)) - here);
            pixel = floatBitsToUint(steps);
        }
        return;
    }
    RowConstants row = set_up.rows[uint(gl_FragCoord.y)];
    float n = floor(gl_FragCoord.x);
    precise vec3 terms = fma(band.plane[0], vec3(n), row.start);
    if (OUTPUT != DERIVATIVES) {
        pixel = words(terms);
    } else {
        precise vec2 dy = fma(row.dy_step, vec2(n), row.dy);
        pixel = floatBitsToUint(derivatives(row, dy, terms.z));
    }
}
