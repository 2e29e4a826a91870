#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "progressive_mesh/surface.glsl"
#include "common/light.glsl"

layout(location = 0) in vec3 object_normal;
layout(location = 0) out vec4 colour;  // linear light

const float ALBEDO = 0.6;

void main() {
    colour = vec4(ALBEDO * light(object_normal, view.sun), 1.0);
}
