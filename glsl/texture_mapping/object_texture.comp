#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/object_space.glsl"

// Stage 3: a thread textures a fragment with a bilinear sample of the polygon's level, rounded to bytes.
layout(local_size_x = 64) in;
#include "common/line.glsl"

layout(binding = 1, scalar) readonly buffer Polygons { RotatedTriangle of[]; } polygons;
layout(binding = 2, scalar) readonly buffer Counts { uint fragments; uint depth_tests; uint sums; } counts;
layout(binding = 3, scalar) readonly buffer Fragments { uvec2 of[]; } fragments;
layout(binding = 4, scalar) writeonly buffer Colours { uint of[]; } colours;
layout(binding = 7) uniform texture2D texture_of;  // repeats over the plane; its sides are powers of two

vec3 texel(ivec2 at, uint level) {
    return 255.0 * texelFetch(texture_of, at & ((1 << int(object.coarsest - level)) - 1), int(level)).rgb;
}

void main() {
    uint n = line_invocation();
    if (n >= min(counts.fragments, object.capacity)) return;
    uvec2 fragment = fragments.of[n];
    RotatedTriangle own = polygons.of[fragment.x];
    vec2 place = lattice(fragment.y);
    vec2 at = vec2(form(own.u, place), form(own.v, place)) - 0.5;
    ivec2 corner = ivec2(floor(at));
    vec2 part = at - floor(at);
    vec3 near = mix(texel(corner, own.level), texel(corner + ivec2(1, 0), own.level), part.x);
    vec3 far = mix(texel(corner + ivec2(0, 1), own.level), texel(corner + 1, own.level), part.x);
    uvec3 bytes = uvec3(mix(near, far, part.y) + 0.5);
    colours.of[n] = bytes.r | bytes.g << 8 | bytes.b << 16;
}
