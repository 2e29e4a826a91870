#version 460
// The yardstick: the same mesh with one plain trilinear texture and implicit derivatives.
layout(binding = 0) uniform sampler2D plain;
layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
layout(location = 0) out vec4 colour;

void main() { colour = texture(plain, vec2(triangle_origin) * exp2(-32.0) + from_origin); }
