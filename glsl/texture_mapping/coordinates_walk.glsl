// How the threads of a row share its pixels.
layout(constant_id = 2) const uint WALK = 0;
const uint LANES = 0, TWO_ENDS = 1, RESTART = 2;

layout(local_size_x = 64) in;
#include "common/line.glsl"

layout(binding = 2, scalar) writeonly buffer Pixels { uint words[]; } pixels;

// A thread's pixels: `count` pixels from column `first`, `stride` columns apart.
struct ThreadPixels {
    uint row;
    uint first;
    int stride;
    uint count;
};

// Threads beyond the last row get no pixels.
ThreadPixels walk() {
    uint row = line_invocation() / band.lanes, lane = line_invocation() % band.lanes;
    uint width = band.size.x;
    ThreadPixels own = ThreadPixels(row, lane, int(band.lanes), (width - lane + band.lanes - 1u) / band.lanes);
    if (WALK == TWO_ENDS) {
        own.first = lane * (width - 1u);
        own.stride = 1 - 2 * int(lane);
    }
    if (WALK == RESTART) own = ThreadPixels(row, lane * band.run, 1, min(band.run, width - lane * band.run));
    if (row >= band.size.y) own.count = 0u;
    return own;
}

// Writes one word per pixel for TEXEL, else four.
void store(ThreadPixels own, uint n, uvec4 words) {
    uint at = own.row * band.size.x + uint(int(own.first) + int(n) * own.stride);
    if (OUTPUT == TEXEL) {
        pixels.words[at] = words.x;
    } else {
        for (uint word = 0; word < 4u; word++) pixels.words[4u * at + word] = words[word];
    }
}
