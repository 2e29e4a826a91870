// A texel of a repeating relief. Needs `relief.side`, a power of two.
uint place(ivec2 at) {
    uvec2 inside = uvec2(at) & (relief.side - 1u);
    return inside.y * relief.side + inside.x;
}
