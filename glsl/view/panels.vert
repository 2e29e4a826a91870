#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

// A vertex of egui: position in points from the window's corner, texture coordinates, premultiplied sRGB.
layout(location = 0) in vec2 position;
layout(location = 1) in vec2 place;
layout(location = 2) in uint packed_colour;
layout(push_constant, scalar) uniform Panels {
    vec2 points;  // size of the window in points
} panels;

layout(location = 0) out vec2 texture_place;
layout(location = 1) out vec4 vertex_colour;

void main() {
    gl_Position = vec4(2.0 * position / panels.points - 1.0, 0.0, 1.0);
    texture_place = place;
    vertex_colour = unpackUnorm4x8(packed_colour);
}
