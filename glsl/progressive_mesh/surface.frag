#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "progressive_mesh/surface.glsl"

layout(location = 0) in vec3 object_normal;
layout(location = 0) out vec4 colour;  // linear light

// Lambert's cosine under a sun of 0.75, and a sky that lights every place by 0.25.
const float ALBEDO = 0.6;
const float SKY = 0.25;

void main() {
    float cosine = dot(normalize(object_normal), view.sun);
    colour = vec4(vec3(ALBEDO * (SKY + (1.0 - SKY) * max(cosine, 0.0))), 1.0);
}
