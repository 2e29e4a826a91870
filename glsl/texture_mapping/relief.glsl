// The settings of a pass over a repeating relief: relief/mod.rs.

layout(push_constant, scalar) uniform ReliefPush {
    uint side;        // texels, and cells of a map
    uint layers;      // of a distance map
    float depth;      // texels
    float map_unit;   // texels per step of a quantised map
    vec3 direction;   // of all rays
    uint columns;     // rays along a side of the grid
    int radius;       // of the search for the nearest cell
    uint first_row;   // first row of cells of a dispatch
} relief;

#include "texture_mapping/relief_place.glsl"
