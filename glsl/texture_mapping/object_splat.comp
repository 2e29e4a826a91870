#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/object_space.glsl"

// Stage 4: a thread rotates a fragment back, projects it, and adds it to the four surrounding pixels. A first pass
// finds the nearest depth of each pixel; a second pass adds the weighted colours of fragments that are not behind it.
// Sums are integers, so their order does not matter.
layout(local_size_x = 64) in;
#include "common/line.glsl"

layout(constant_id = 0) const uint SUMS = 0;   // 0: the depth test
layout(constant_id = 1) const uint COUNT = 0;  // 1: counts the atomics

layout(binding = 1, scalar) readonly buffer Polygons { RotatedTriangle of[]; } polygons;
layout(binding = 2, scalar) buffer Counts { uint fragments; uint depth_tests; uint sums; } counts;
layout(binding = 3, scalar) readonly buffer Fragments { uvec2 of[]; } fragments;
layout(binding = 4, scalar) readonly buffer Colours { uint of[]; } colours;
layout(binding = 5, scalar) buffer Nearest { uint of[]; } nearest;    // bits of the largest 1 / w
layout(binding = 6, scalar) buffer Sums { uvec4 of[]; } sums;         // of weights, and of weighted bytes

const float WEIGHT_ONE = 1024.0;
// A fragment is behind if its 1 / w is smaller than the largest by more than this share. At a pixel, the planes of
// neighbouring facets differ by less.
const float BEHIND = 1.0 / 256.0;

// A fragment's position on the screen in pixels; the centre of pixel (0, 0) is (0, 0).
vec2 projected(RotatedTriangle own, vec2 place) {
    vec2 at = (vec2(own.first) + place) * object.spacing;
    vec4 turn = own.turn;
    float x = at.x * turn.z + own.z * turn.w;
    float leaning = own.z * turn.z - at.x * turn.w;
    float y = at.y * turn.x + leaning * turn.y;
    float z = leaning * turn.x - at.y * turn.y;
    return vec2(x, y) / denominator(z) + 0.5 * vec2(object.size) - 0.5;
}

void add(RotatedTriangle own, uint n, ivec2 pixel, float part) {
    uint weight = uint(part * WEIGHT_ONE + 0.5);
    if (weight == 0u || any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, ivec2(object.size)))) return;
    uint at = uint(pixel.y) * object.size.x + uint(pixel.x);
    vec2 centre = vec2(pixel) + 0.5 - 0.5 * vec2(object.size);
    // The depth of the polygon's plane at the pixel's centre, so that a polygon's fragments have equal depths there.
    float near = clamp(form(own.nearness, centre), own.range.x, own.range.y);
    if (SUMS == 0u) {
        atomicMax(nearest.of[at], floatBitsToUint(near));
        if (COUNT == 1u) atomicAdd(counts.depth_tests, 1u);
        return;
    }
    if (near < uintBitsToFloat(nearest.of[at]) * (1.0 - BEHIND)) return;
    uvec3 bytes = uvec3(colours.of[n], colours.of[n] >> 8, colours.of[n] >> 16) & 255u;
    atomicAdd(sums.of[at].x, weight);
    atomicAdd(sums.of[at].y, weight * bytes.r);
    atomicAdd(sums.of[at].z, weight * bytes.g);
    atomicAdd(sums.of[at].w, weight * bytes.b);
    if (COUNT == 1u) atomicAdd(counts.sums, 4u);
}

void main() {
    uint n = line_invocation();
    if (n >= min(counts.fragments, object.capacity)) return;
    RotatedTriangle own = polygons.of[fragments.of[n].x];
    vec2 at = projected(own, lattice(fragments.of[n].y));
    // Positions far outside the picture do not fit an int.
    if (!all(lessThan(abs(at), vec2(1e6)))) return;
    vec2 part = at - floor(at);
    ivec2 corner = ivec2(floor(at));
    add(own, n, corner, (1.0 - part.x) * (1.0 - part.y));
    add(own, n, corner + 1, part.x * part.y);
    add(own, n, corner + ivec2(1, 0), part.x * (1.0 - part.y));
    add(own, n, corner + ivec2(0, 1), (1.0 - part.x) * part.y);
}
