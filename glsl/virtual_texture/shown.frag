#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/footprint.glsl"
#include "virtual_texture/tile_pool.glsl"

// Writes for each pixel the requested tile, in the grid of the tile's own level, and the level of the tile that is
// shown. Needs a request image with four words per pixel.
layout(binding = 0) uniform utexture2D requests;
layout(push_constant, scalar) uniform Shown {
    uint level_bias;  // as in view.glsl
} shown;

layout(location = 0) out uvec4 tile;  // level, row, column, level shown; all ones for the background

void main() {
    uvec4 stored = texelFetch(requests, ivec2(gl_FragCoord.xy), 0);
    uvec3 qij = load_triple(stored);
    uint q = min(qij.x + shown.level_bias, FIRST_RESIDENT_LEVEL);
    tile = stored.x == BACKGROUND ? uvec4(BACKGROUND)
                               : uvec4(qij.x, qij.yz >> qij.x, find_resident(q, qij.yz).level);
}
