#version 460
layout(location = 0) flat out uint index;

void main() { index = uint(gl_VertexIndex); }
