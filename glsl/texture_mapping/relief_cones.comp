#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/relief.glsl"

layout(binding = 0, scalar) readonly buffer Heights { float texels[]; } heights;
#include "texture_mapping/relief_heights.glsl"

// A thread finds the widest cone on a texel: `cone_map` in maps.rs has the definition.
layout(local_size_x = 64) in;

layout(constant_id = 0) const uint RELAXED = 0;
const uint MARCH = 32;  // steps inside the solid

layout(binding = 5, scalar) writeonly buffer Cones { float texels[]; } cones;

float texel(vec2 at) { return heights.texels[place(ivec2(floor(at + 0.5)))]; }

// The point, relative to `own`, at which a ray leaves the solid again. The ray starts on the top plane above `own` and
// passes through (offset, height).
vec3 leaves(ivec2 own, vec2 offset, float height) {
    // MARCH steps lead from (offset, height) to the floor.
    precise vec3 along = vec3(offset, height - relief.depth) * (height / (relief.depth - height) / float(MARCH));
    for (uint n = 0; n <= MARCH; n++) {
        precise vec3 at = vec3(offset, height) + float(n) * along;
        if (texel(vec2(own) + at.xy) < at.z) return at;
    }
    return vec3(offset, 0.0);
}

void main() {
    ivec2 own = ivec2(gl_GlobalInvocationID.x, relief.first_row + gl_WorkGroupID.y);
    if (own.x >= int(relief.side)) return;
    float height = heights.texels[place(own)];
    float widest = 1.0;
    // An obstacle at a distance of more than the relief's depth cannot narrow a cone with a ratio of 1.
    int reach = min(int(relief.side) / 2, int(ceil(relief.depth)));
    for (int b = -reach; b <= reach; b++) {
        for (int a = -reach; a <= reach; a++) {
            vec3 obstacle = vec3(a, b, heights.texels[place(own + ivec2(a, b))]);
            if (obstacle.z <= height) continue;
            if (RELAXED == 1u && obstacle.z < relief.depth) obstacle = leaves(own, obstacle.xy, obstacle.z);
            float above = obstacle.z - height;
            if (above > 0.0) widest = min(widest, length(obstacle.xy) / above);
        }
    }
    cones.texels[place(own)] = widest;
}
