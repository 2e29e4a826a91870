#version 460
// The pipeline's logic operation ORs the output into the tile mask.
layout(location = 0) flat in uint mask;
layout(location = 0) out uvec4 tile_mask;

void main() { tile_mask = uvec4(mask, 0, 0, 0); }
