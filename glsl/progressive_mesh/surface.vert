#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "progressive_mesh/surface.glsl"
#include "progressive_mesh/heavy.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;

layout(location = 0) out vec3 object_normal;

void main() {
    gl_Position = view.object_to_clip * vec4(worked(position), 1.0);
    object_normal = normal;
}
