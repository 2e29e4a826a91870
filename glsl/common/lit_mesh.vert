#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "common/view.glsl"
#include "common/clip.glsl"

// mesh.vert for lit shapes.
layout(location = 0) in vec3 position_high;
layout(location = 1) in vec3 position_low;
layout(location = 2) in uvec2 origin;
layout(location = 3) in vec2 offset;

// Normals are in a separate buffer, so that unlit passes read the same vertices.
layout(binding = 7, scalar) readonly buffer Normals { vec3 of_vertex[]; } normals;

layout(location = 0) flat out uvec2 triangle_origin;
layout(location = 1) out vec2 from_origin;
layout(location = 2) out vec3 normal;

invariant gl_Position;

void main() {
    gl_Position = clip_position(position_high, position_low);
    triangle_origin = origin;
    from_origin = offset;
    normal = normals.of_vertex[gl_VertexIndex];
}
