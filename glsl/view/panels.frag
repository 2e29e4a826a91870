#version 460

// egui blends sRGB codes without decoding them; the window's format stores them unchanged.
layout(binding = 0) uniform sampler2D image;
layout(location = 0) in vec2 texture_place;
layout(location = 1) in vec4 vertex_colour;
layout(location = 0) out vec4 colour;

void main() { colour = vertex_colour * texture(image, texture_place); }
