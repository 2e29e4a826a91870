#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/relief.glsl"

// A ray for each thread: trace.rs is its twin.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint TRACER = 0;
const uint LINEAR = 0, DISTANCES = 1, CONES = 2, RELAXED_CONES = 3;
layout(constant_id = 1) const uint MAP_BITS = 32;  // 8 and 16: several cells a word, times the map's unit

const float LEAST_STEP = 0.5;
const uint HALVINGS = 6, RELAXED_HALVINGS = 12, MOST_STEPS = 1024, LINEAR_STEPS = 64;

layout(binding = 1, scalar) readonly buffer Map { uint words[]; } map;
layout(binding = 2, scalar) writeonly buffer Hits { uvec2 rays[]; } hits;

vec3 point(vec2 origin, float t) {
    precise vec3 at = vec3(origin, relief.depth) + t * relief.direction;
    return at;
}

// Height above the surface.
float above(vec3 at) {
    vec2 cell = floor(at.xy), inside = at.xy - cell;
    vec4 of = corners(ivec2(cell));
    precise float near = of.x + (of.y - of.x) * inside.x, far = of.z + (of.w - of.z) * inside.x;
    precise float height = at.z - (near + (far - near) * inside.y);
    return height;
}

float map_texel(uint at) {
    if (MAP_BITS == 32u) return uintBitsToFloat(map.words[at]);
    uint each = 32u / MAP_BITS;
    return float(bitfieldExtract(map.words[at / each], int(at % each * MAP_BITS), int(MAP_BITS))) * relief.map_unit;
}

// How far the ray may go from a point.
float allowed(vec3 at) {
    ivec2 cell = ivec2(floor(at.xy));
    if (TRACER == DISTANCES) {
        uint layer = min(uint(max(at.z * (float(relief.layers) / relief.depth), 0.0)), relief.layers - 1u);
        return map_texel(layer * relief.side * relief.side + place(cell));
    }
    // The least cone of the corners; the ray meets its side where both are equally high.
    vec4 cones = uintBitsToFloat(uvec4(map.words[place(cell)], map.words[place(cell + ivec2(1, 0))],
                                       map.words[place(cell + ivec2(0, 1))], map.words[place(cell + 1)]));
    float cone = min(min(cones.x, cones.y), min(cones.z, cones.w));
    return cone * max(above(at), 0.0) / (length(relief.direction.xy) - cone * relief.direction.z);
}

float halve(vec2 origin, float above_at, float below_at) {
    uint halvings = HALVINGS;
    if (TRACER == RELAXED_CONES) halvings = RELAXED_HALVINGS;
    for (uint n = 0; n < halvings; n++) {
        precise float middle = 0.5 * (above_at + below_at);
        if (above(point(origin, middle)) > 0.0) above_at = middle; else below_at = middle;
    }
    return below_at;
}

void main() {
    uvec2 ray = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(ray, uvec2(relief.columns)))) return;
    precise vec2 origin = (vec2(ray) + 0.5) * (float(relief.side) / float(relief.columns));
    float t = 0.0, fixed_step = -relief.depth / relief.direction.z / float(LINEAR_STEPS);
    uint steps = 0;
    while (steps < MOST_STEPS) {
        float step = TRACER == LINEAR ? fixed_step : allowed(point(origin, t));
        // Guaranteed steps cannot pass the surface; all others are tested.
        bool may_pass = step < LEAST_STEP;
        if (TRACER == LINEAR) may_pass = true;
        if (TRACER == RELAXED_CONES) may_pass = true;
        if (TRACER != LINEAR) step = max(step, LEAST_STEP);
        precise float next = t + step;
        steps++;
        if (may_pass && above(point(origin, next)) <= 0.0) {
            t = halve(origin, t, next);
            break;
        }
        t = next;
    }
    hits.rays[ray.y * relief.columns + ray.x] = uvec2(floatBitsToUint(t), steps);
}
