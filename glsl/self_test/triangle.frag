#version 460
// `ortelius doctor`: the pixel's index, from an interpolated value.
layout(location = 0) in vec2 at;
layout(location = 0) out uint index;

void main() { index = uint(at.x) + 16 * uint(at.y); }
