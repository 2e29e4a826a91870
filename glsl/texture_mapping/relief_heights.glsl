// A relief's heights. Needs `relief.side`, a power of two, and `heights.texels`.
uint place(ivec2 at) {
    uvec2 inside = uvec2(at) & (relief.side - 1u);
    return inside.y * relief.side + inside.x;
}

// Heights at a cell's corners.
vec4 corners(ivec2 cell) {
    return vec4(heights.texels[place(cell)], heights.texels[place(cell + ivec2(1, 0))],
                heights.texels[place(cell + ivec2(0, 1))], heights.texels[place(cell + 1)]);
}
