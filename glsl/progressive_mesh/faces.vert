#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

// A corner of a face, read directly from the buffers. All vertex formats begin with the position.
layout(binding = 0, scalar) readonly buffer Indices { uint words[]; } indices;
#include "progressive_mesh/indices.glsl"
layout(binding = 1, scalar) readonly buffer Misses { uint faces[]; } misses;
layout(binding = 2, scalar) readonly buffer Vertices { float words[]; } vertices;
layout(binding = 3, scalar) readonly buffer Levels { uint vertices[]; } levels;  // live vertices of each level
layout(push_constant, scalar) uniform FaceView {
    mat4 object_to_clip;
    uint first_face;  // in the index buffer
    uint stride;      // words of a vertex
    uint instance;    // counted over the visible instances of all surfaces
    uint levels;
} view;

// Four words: instance, face, the first level with the face, and (that level scaled to 0 .. 255) << 8 | misses.
layout(location = 0) flat out uvec4 face;
layout(location = 1) out vec3 corner;

// The first level at which a vertex is live.
uint birth(uint vertex) {
    uint from = 0, to = view.levels - 1;
    while (from < to) {
        uint middle = (from + to) / 2;
        if (levels.vertices[middle] > vertex) to = middle; else from = middle + 1;
    }
    return from;
}

void main() {
    uint n = view.first_face + gl_VertexIndex / 3;
    uvec3 ends = uvec3(index_at(3 * n), index_at(3 * n + 1), index_at(3 * n + 2));
    uint vertex = ends[gl_VertexIndex % 3], at = vertex * view.stride;
    vec3 position = vec3(vertices.words[at], vertices.words[at + 1], vertices.words[at + 2]);
    uint level = birth(max(ends.x, max(ends.y, ends.z)));
    uint share = 255 * level / max(view.levels - 1, 1);
    face = uvec4(view.instance, gl_VertexIndex / 3, level, share << 8 | misses.faces[n]);
    corner = vec3(0.0);
    corner[gl_VertexIndex % 3] = 1.0;
    gl_Position = view.object_to_clip * vec4(position, 1.0);
}
