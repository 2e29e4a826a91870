#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/relief.glsl"

layout(binding = 0, scalar) readonly buffer Heights { float texels[]; } heights;
#include "texture_mapping/relief_heights.glsl"

// One ray per thread.
layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 1, scalar) readonly buffer Map { uint words[]; } map;
layout(binding = 2, scalar) writeonly buffer Hits { uvec2 rays[]; } hits;

#include "texture_mapping/relief_ray.glsl"

void main() {
    uvec2 ray = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(ray, uvec2(relief.columns)))) return;
    precise vec2 origin = (vec2(ray) + 0.5) * (float(relief.side) / float(relief.columns));
    Traced hit = traced(origin, relief.direction);
    hits.rays[ray.y * relief.columns + ray.x] = uvec2(floatBitsToUint(hit.distance), hit.steps);
}
