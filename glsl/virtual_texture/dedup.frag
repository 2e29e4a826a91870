#version 460
// The logic operation of the pipeline ORs this into U2.
layout(location = 0) flat in uint mask;
layout(location = 0) out uvec4 u2;

void main() { u2 = uvec4(mask, 0, 0, 0); }
