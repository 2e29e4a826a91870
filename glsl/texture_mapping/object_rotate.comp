#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/object_space.glsl"

// Stage 1: a thread rotates a triangle and sets up its lattice.
layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Triangles { Triangle of[]; } triangles;
layout(binding = 1, scalar) writeonly buffer Polygons { RotatedTriangle of[]; } polygons;

// Fragments on a shared edge belong to both triangles: a lost one would leave a hole.
const float EDGE_MARGIN = 1.0 / 64.0;

// Rotates about x by a, then about y by b.
vec3 rotated(vec4 turn, vec3 at) {
    float leaning = at.y * turn.y + at.z * turn.x;
    return vec3(at.x * turn.z - leaning * turn.w, at.y * turn.x - at.z * turn.y, at.x * turn.w + leaning * turn.z);
}

vec4 turn_of(vec3 normal) {
    float d = length(normal.yz);
    vec2 a = d > 0.0 ? normal.zy / d : vec2(1.0, 0.0);
    return vec4(a, d, normal.x);
}

// The affine function with these values at the corners `at`: its slopes, and its value at (0, 0).
vec3 affine(vec2 at[3], vec3 values, float area) {
    vec2 p = at[1] - at[0], q = at[2] - at[0];
    float first = values.y - values.x, second = values.z - values.x;
    vec2 slope = vec2(first * q.y - second * p.y, second * p.x - first * q.x) / area;
    return vec3(slope, values.x - dot(slope, at[0]));
}

// 1 / w over the screen, and its range.
void nearness_of(Triangle own, vec3 normal, float z, inout RotatedTriangle polygon) {
    vec3 near = 1.0 / vec3(denominator(own.corners[0].z), denominator(own.corners[1].z), denominator(own.corners[2].z));
    polygon.range = vec2(min(min(near.x, near.y), near.z), max(max(near.x, near.y), near.z));
    float through = z - normal.z * object.camera;
    // A plane through the eye is edge-on; its 1 / w counts as constant.
    polygon.nearness = abs(through) > 1e-6 * object.camera
        ? vec3(normal.xy, -normal.z * object.camera) / through : vec3(0.0, 0.0, polygon.range.y);
}

void main() {
    uint n = gl_GlobalInvocationID.x;
    if (n >= object.triangles) return;
    Triangle own = triangles.of[n];
    RotatedTriangle polygon;
    polygon.count = ivec2(0);
    vec3 across = cross(own.corners[1] - own.corners[0], own.corners[2] - own.corners[0]);
    float max_z = max(max(own.corners[0].z, own.corners[1].z), own.corners[2].z);
    bool seen = dot(across, across) > 0.0 && denominator(max_z) > 0.0;
    vec3 normal = seen ? normalize(across) : vec3(0.0, 0.0, 1.0);
    polygon.turn = turn_of(normal);
    vec2 at[3];
    vec2 low = vec2(3.4e38), high = vec2(-3.4e38);
    for (int c = 0; c < 3; c++) {
        vec3 corner = rotated(polygon.turn, own.corners[c]);
        polygon.z = corner.z;
        at[c] = corner.xy / object.spacing;
        low = min(low, at[c]);
        high = max(high, at[c]);
    }
    polygon.first = ivec2(ceil(low - EDGE_MARGIN));
    if (seen) polygon.count = ivec2(floor(high + EDGE_MARGIN)) - polygon.first + 1;
    for (int c = 0; c < 3; c++) at[c] -= vec2(polygon.first);
    float area = (at[1].x - at[0].x) * (at[2].y - at[0].y) - (at[2].x - at[0].x) * (at[1].y - at[0].y);
    for (int c = 0; c < 3; c++) {
        vec2 from = at[c], along = (at[(c + 1) % 3] - from) * sign(area);
        vec2 inwards = vec2(-along.y, along.x);
        polygon.edges[c] = vec3(inwards, EDGE_MARGIN * length(along) - dot(inwards, from));
    }
    vec3 u = affine(at, vec3(own.texels[0].x, own.texels[1].x, own.texels[2].x), area);
    vec3 v = affine(at, vec3(own.texels[0].y, own.texels[1].y, own.texels[2].y), area);
    // All fragments of a polygon have one depth and so one level: the level whose texels are as far apart as the
    // fragments.
    float step = max(length(vec2(u.x, v.x)), length(vec2(u.y, v.y)));
    polygon.level = uint(clamp(floor(log2(max(step, 1e-30)) + 0.5), 0.0, float(object.coarsest)));
    float scale = exp2(-float(polygon.level));
    polygon.u = u * scale;
    polygon.v = v * scale;
    nearness_of(own, normal, polygon.z, polygon);
    polygons.of[n] = polygon;
}
