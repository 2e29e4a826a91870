// Shared by all filters: the texture and the targets.
#include "common/exact.glsl"
layout(binding = 0) uniform sampler2D texture_of;  // repeats over the plane; its sides are powers of two
layout(constant_id = 0) const uint COARSEST = 0;  // the level of one texel

layout(location = 0) out vec4 colour;  // alpha: texels fetched
#if DUMP
layout(location = 1) out vec4 place;  // u, v, det J; 1 if the pixel shows the plane, else 0
layout(location = 2) out vec4 jacobian;
layout(location = 3) out vec4 decisions;  // level; 1 if no texel had a weight; texels visited
#endif

struct Filtered {
    vec3 colour;
    uint fetched;
    uint level;
    bool empty;
    uint visited;
};

// The texture repeats: columns and rows of a level wrap.
vec3 texel(ivec2 at, uint level) {
    return texelFetch(texture_of, at & ((1 << int(COARSEST - level)) - 1), int(level)).rgb;
}

void store(Pixel pixel, Filtered filtered) {
    colour = pixel.seen ? vec4(filtered.colour, float(filtered.fetched)) : vec4(0.0);
#if DUMP
    place = vec4(pixel.centre, pixel.det, pixel.seen);
    jacobian = pixel.jacobian;
    decisions = vec4(filtered.level, filtered.empty, filtered.visited, 0.0);
#endif
}
