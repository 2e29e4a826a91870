#version 460

// Two triangles over the whole target.
void main() {
    uint corner = uint[](0u, 2u, 1u, 1u, 2u, 3u)[gl_VertexIndex];
    gl_Position = vec4(vec2(corner & 1u, corner >> 1) * 2.0 - 1.0, 0.5, 1.0);
}
