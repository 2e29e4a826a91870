#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "progressive_mesh/surface.glsl"
#include "progressive_mesh/heavy.glsl"

// A vertex with the split that created it: see surface/vertices.rs.
struct MorphVertex {
    vec3 position;
    float birth_log2;   // log2 of the chosen error (surface.glsl) below which the vertex appears; 1000 for level 0
    vec3 normal;
    uint split_vertex;  // the vertex at whose position this vertex starts; its own index for a vertex of level 0
};

layout(binding = 0, scalar) readonly buffer Morph { MorphVertex vertices[]; } morph;

layout(location = 0) out vec3 object_normal;

// Progress of a vertex from its split vertex's position to its own position: 0 at birth, 1 once the chosen error has
// fallen by the factor 2^band_log2.
float arrived(MorphVertex vertex) {
    return clamp((vertex.birth_log2 - view.wanted_log2) / view.band_log2, 0.0, 1.0);
}

// The split vertex may itself be moving: its position is mixed with that of its own split vertex, and so on. The sum
// over the ancestors ends at an ancestor that has reached its own position, at the latest at a vertex of level 0.
// Ancestors are born earlier, so their progress is at least as large, and a new vertex starts exactly at the drawn
// position of its split vertex.
void main() {
    MorphVertex vertex = morph.vertices[gl_VertexIndex];
    vec3 place = vec3(0.0);
    vec3 normal = vec3(0.0);
    float left = 1.0;
    for (;;) {
        float share = left * arrived(vertex);
        place += share * vertex.position;
        normal += share * vertex.normal;
        left -= share;
        if (left <= 0.0) {
            break;
        }
        vertex = morph.vertices[vertex.split_vertex];
    }
    gl_Position = view.object_to_clip * vec4(worked(place), 1.0);
    object_normal = normal;
}
