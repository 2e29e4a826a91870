#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
#include "common/extensions.glsl"
#include "virtual_texture/pyramid.glsl"
#include "virtual_texture/tile_order.glsl"
#include "virtual_texture/dedup.glsl"
#include "virtual_texture/dedup_tile_mask.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 8) const uint SIDE_LOG2 = 3;  // log2 of the side of an invocation's square of pixels

// Four neighbouring texels of the request image, by channel.
struct Quad {
    uvec4 x, y, z;
};

// Gathers at the common corner of four texels. Only a rounding error of half a texel would select other texels.
Quad gather_quad(uvec2 first) {
    vec2 corner = (vec2(first) + 1.0) / vec2(textureSize(requests, 0));
    uvec4 x = textureGather(requests, corner, 0);
    if (REQUESTS_PACKED == 1) return Quad(x, uvec4(0), uvec4(0));
    return Quad(x, textureGather(requests, corner, 1), textureGather(requests, corner, 2));
}

bool all_are(Quad quad, uvec3 stored) {
    bool same = REQUESTS_PACKED == 1 || quad.y == uvec4(stored.y) && quad.z == uvec4(stored.z);
    return quad.x == uvec4(stored.x) && same;
}

// The paper's memo (a triple that repeats the previous one is skipped), applied to four texels at a time. While no
// lane's triple changes, a subgroup only reads. A software device runs both sides of every branch. So the code that
// sets the mask is outside the reading loop and runs once per change. The lanes leave the reading loop together,
// because in lavapipe 22.3 a lane that leaves early gets the values of later lanes.
void main() {
    uvec2 first = gl_GlobalInvocationID.xy << SIDE_LOG2;
    const uint quads_log2 = SIDE_LOG2 - 1u, quads = 1u << 2u * quads_log2;
    uvec3 last = uvec3(BACKGROUND);
    uint n = 0;
    while (n < quads) {
        Quad quad;
        do {
            quad = gather_quad(first + 2u * uvec2(n & ((1u << quads_log2) - 1u), n >> quads_log2));
            n++;
        } while (n < quads && subgroupAll(all_are(quad, last)));
        for (uint k = 0; k < 4; k++) {
            uvec3 stored = uvec3(quad.x[k], quad.y[k], quad.z[k]);
            if (same_triple(stored, last)) continue;
            last = stored;
            uvec3 qij = addressed_triple(stored);
            if (qij.x < FIRST_RESIDENT_LEVEL) mark(qij);
        }
    }
}
