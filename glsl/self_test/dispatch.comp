#version 460
// `ortelius doctor`: does a dispatch run at all? Writes 3 x + 1.
layout(local_size_x = 64) in;
layout(binding = 0) buffer Words { uint words[]; } words;

void main() { words.words[gl_GlobalInvocationID.x] = 3 * gl_GlobalInvocationID.x + 1; }
