#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "common/view.glsl"
#include "common/clip.glsl"

// mesh.vert for a depth-only pass. Without texture coordinates, triangles share more vertices.
layout(location = 0) in vec3 position_high;
layout(location = 1) in vec3 position_low;

invariant gl_Position;

void main() { gl_Position = clip_position(position_high, position_low); }
