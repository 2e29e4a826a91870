// The reach: the neighbours of a pixel's tile from which its filter reads texels (not in the paper). No filter reaches
// further than half a tile, so each axis has at most one neighbour. A reach has two bits for columns, then two for
// rows: 0 for none, 1 for the next tile, 2 for the previous one. Needs pyramid.glsl.

// True if the reach includes neighbour n: 1 is the neighbour in the same row, 2 in the same column, 3 across the
// corner.
bool reaches(uint reach, uint n) {
    return ((n & 1u) == 0u || (reach & 3u) != 0u) && ((n & 2u) == 0u || reach >> 2 != 0u);
}

// The triple of neighbour n, with (i, j) in level 0's grid. Columns wrap; beyond a pole lies the same row, half a turn
// away.
uvec3 neighbour(uvec3 qij, uint reach, uint n) {
    ivec2 tile = ivec2(qij.zy >> qij.x), grid = ivec2(tile_grid() >> qij.x);
    if ((n & 1u) != 0u) tile.x += (reach & 3u) == 1u ? 1 : -1;
    int row = tile.y;
    if ((n & 2u) != 0u) row += reach >> 2 == 1u ? 1 : -1;
    bool beyond = row < 0 || row >= grid.y;
    tile = ivec2(tile.x + (beyond ? grid.x / 2 : 0) & (grid.x - 1), beyond ? tile.y : row);
    return uvec3(qij.x, uvec2(tile.yx) << qij.x);
}
