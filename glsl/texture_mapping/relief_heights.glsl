// A relief's heights. Needs relief_place.glsl and `heights.texels`.

// Heights at a cell's corners.
vec4 corners(ivec2 cell) {
    return vec4(heights.texels[place(cell)], heights.texels[place(cell + ivec2(1, 0))],
                heights.texels[place(cell + ivec2(0, 1))], heights.texels[place(cell + 1)]);
}
