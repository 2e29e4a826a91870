#version 460
// variants QUALIFIER: noperspective smooth
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/coordinates.glsl"

layout(location = 0) QUALIFIER in vec3 terms;
layout(location = 0) out uvec4 pixel;

void main() { pixel = words(terms); }
