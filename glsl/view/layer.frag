#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

// Copies or blends the panels' layer, a texel for each pixel, in the window's codes.
layout(binding = 0) uniform texture2D layer;
layout(location = 0) out vec4 colour;

void main() { colour = texelFetch(layer, ivec2(gl_FragCoord.xy), 0); }
