#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/relief.glsl"
#include "texture_mapping/relief_root.glsl"

// A workgroup builds a column of cells of a distance map: maps.rs has the definition.
layout(local_size_x = 64) in;

layout(constant_id = 0) const uint REFINED = 0;
layout(constant_id = 1) const uint EVERYWHERE = 0;  // 1: distances hold everywhere in a cell; 0: at its centre
const uint SECTORS = 64, REACH = 32;
const float NONE = 3.4e38;

// Least and greatest height of each cell; without EVERYWHERE, both are the height at its centre.
layout(binding = 0, scalar) readonly buffer Bounds { vec2 cells[]; } bounds;
// For each cell, the least height in the square of cells that starts at this cell (Fan::lows).
layout(binding = 1, scalar) readonly buffer Lows { float squares[]; } lows;
layout(binding = 2, scalar) readonly buffer Starts { uint words[]; } starts;
layout(binding = 3, scalar) readonly buffer Squares { ivec2 offsets[]; } squares;
// Near cells, the nearest first: offset, first sector behind the cell, number of sectors.
layout(binding = 4, scalar) readonly buffer Near { ivec4 cells[]; } near;
layout(binding = 5, scalar) readonly buffer Inverses { float values[]; } inverses;
layout(binding = 6, scalar) writeonly buffer Distances { float texels[]; } distances;

shared float horizons[SECTORS];
shared float least[SECTORS];

// The square of the least distance along the plane to a point of the cell at an offset.
float squared_across(ivec2 offset) {
    float extent = 0.0;
    if (EVERYWHERE == 1u) extent = 1.0;
    vec2 gap = max(vec2(abs(offset)) - extent, 0.0);
    precise float across = gap.x * gap.x + gap.y * gap.y;
    return across;
}

// The squared distance to the surface in a near cell; NONE if no ray through `cell` can hit it.
float squared_distance(ivec2 cell, ivec4 other, float across, float low, float high) {
    vec2 surface = bounds.cells[place(cell + other.xy)];
    float drop = 0.0;
    if (REFINED == 1u && across > 0.0) {
        float slope = NONE;
        for (int n = 0; n < other.w; n++) slope = min(slope, horizons[uint(other.z + n) % SECTORS]);
        precise float steep = slope * exact_root(across);
        drop = steep;
    }
    precise float lowest_point = high - drop;
    if (lowest_point < surface.x) return NONE;
    precise float below = max(max(low - surface.y, drop), 0.0);
    precise float square = across + below * below;
    return square;
}

void main() {
    uint own = gl_LocalInvocationIndex;
    ivec2 cell = ivec2(gl_WorkGroupID.x, relief.first_row + gl_WorkGroupID.y);
    // The least height of the surface at each distance in this thread's sector.
    float lowest[REACH];
    for (uint n = 0; n < REACH; n++) {
        float low = NONE;
        uint end = REFINED == 1u ? starts.words[own * REACH + n + 1u] : 0u;
        for (uint at = starts.words[own * REACH + n]; at < end; at++) {
            low = min(low, lows.squares[place(cell + squares.offsets[at])]);
        }
        lowest[n] = low;
    }
    int square_side = 2 * relief.radius + 1;
    float thickness = relief.depth / float(relief.layers);
    float own_low = bounds.cells[place(cell)].x;
    for (uint layer = 0; layer < relief.layers; layer++) {
        vec2 share = vec2(0.5);
        if (EVERYWHERE == 1u) share = vec2(0.0, 1.0);
        precise float low = (float(layer) + share.x) * thickness;
        precise float high = (float(layer) + share.y) * thickness;
        uint at = layer * relief.side * relief.side + place(cell);
        // Wholly below the surface.
        if (high <= own_low) {
            if (own == 0u) distances.texels[at] = 0.0;
            continue;
        }
        float steepest = 0.0;
        for (uint n = 0; n < REACH && REFINED == 1u; n++) {
            precise float tangent = (lowest[n] - high) * inverses.values[n];
            steepest = max(steepest, tangent);
        }
        horizons[own] = steepest;
        barrier();
        float square = NONE;
        for (int n = int(own); n < square_side * square_side; n += int(SECTORS)) {
            ivec4 other = near.cells[n];
            float across = squared_across(other.xy);
            // All further cells are at least as far.
            if (across >= square) break;
            square = min(square, squared_distance(cell, other, across, low, high));
        }
        least[own] = square;
        barrier();
        if (own == 0u) {
            for (uint n = 1; n < SECTORS; n++) square = min(square, least[n]);
            distances.texels[at] = exact_root(square);
        }
    }
}
