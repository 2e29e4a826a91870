#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "common/view.glsl"
#include "common/clip.glsl"

layout(location = 0) in vec3 position_high;
layout(location = 1) in vec3 position_low;
layout(location = 2) in uvec2 origin;
layout(location = 3) in vec2 offset;

// Constant in a triangle: its three vertices have the same origin.
layout(location = 0) flat out uvec2 triangle_origin;
layout(location = 1) out vec2 from_origin;

// Every pass that draws the mesh must compute the same depth: texturing tests for EQUAL.
invariant gl_Position;

void main() {
    gl_Position = clip_position(position_high, position_low);
    triangle_origin = origin;
    from_origin = offset;
}
