// A relief that repeats, bilinear between texels: relief/mod.rs.

layout(push_constant, scalar) uniform ReliefPush {
    uint side;        // texels, and cells of a map
    uint layers;      // of a distance map
    float depth;      // texels
    float map_unit;   // texels for 1 of a quantised map
    vec3 direction;   // of all rays
    uint columns;     // rays a side
    int radius;       // of the search for the nearest cell
    uint first_row;   // of the cells of a dispatch
} relief;

layout(binding = 0, scalar) readonly buffer Heights { float texels[]; } heights;

// Sides are powers of two.
uint place(ivec2 at) {
    uvec2 inside = uvec2(at) & (relief.side - 1u);
    return inside.y * relief.side + inside.x;
}

// Heights at a cell's corners.
vec4 corners(ivec2 cell) {
    return vec4(heights.texels[place(cell)], heights.texels[place(cell + ivec2(1, 0))],
                heights.texels[place(cell + ivec2(0, 1))], heights.texels[place(cell + 1)]);
}
