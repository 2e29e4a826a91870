#version 460
// variants DUMP: 0 1
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/plane.glsl"
#include "texture_mapping/filtered.glsl"
#include "texture_mapping/footprint.glsl"

// Random single texels (Pharr, Wronski, Salvi and Fajardo, "Filtering after shading with stochastic texture
// filtering", I3D 2024). The truncated Gaussian selects a position in the footprint; the bilinear weights select one
// of its four texels.
layout(constant_id = 1) const uint SAMPLES = 1;
layout(constant_id = 2) const float ALPHA = 2.0;

#include "common/hash.glsl"

void main() {
    Pixel pixel = pixel_at(gl_FragCoord.xy);
    float minor = sqrt(eigenvalues(spread(pixel.jacobian), pixel.det * pixel.det).y);
    uint level = uint(clamp(floor(log2(max(minor, 1e-30))), 0.0, float(COARSEST)));
    float half_power = power_of_half(level);
    vec3 sum = vec3(0.0);
    vec3 first = vec3(0.0);
    for (uint n = 0; n < SAMPLES; ++n) {
        vec4 unit = vec4(hash(uvec4(gl_FragCoord.xy, n, plane.frame)) >> 8) * exp2(-24.0);
        float radius = sqrt(-log(1.0 - unit.x * (1.0 - exp(-ALPHA))) / ALPHA);
        float angle = 6.2831853 * unit.y;
        vec2 in_disc = radius * vec2(cos(angle), sin(angle));
        vec2 moved = vec2(dot(pixel.jacobian.xy, in_disc), dot(pixel.jacobian.zw, in_disc));
        vec2 at = (pixel.centre + moved) * half_power - 0.5 + unit.zw;
        vec3 value = texel(ivec2(floor(at)), level);
        if (n == 0) first = value;
        sum += value - first;
    }
    store(pixel, Filtered(first + sum / float(SAMPLES), SAMPLES, level, false, SAMPLES));
}
