#version 460
layout(location = 0) out vec2 at;

// Half of a 16 x 16 target, in pixels. No pixel's centre lies on an edge.
void main() {
    at = 15.5 * vec2(gl_VertexIndex == 2, gl_VertexIndex == 1);
    gl_Position = vec4(at / 8.0 - 1.0, 0.0, 1.0);
}
