// Traces a ray through a relief, as trace.rs does on the CPU. Needs `relief`, relief_heights.glsl and `map.words`.
layout(constant_id = 70) const uint TRACER = 0;
const uint LINEAR = 0, DISTANCES = 1, CONES = 2, RELAXED_CONES = 3;
layout(constant_id = 71) const uint MAP_BITS = 32;  // 8, 16: several cells per word, in steps of the map's unit

const float MIN_STEP = 0.5;
const uint HALVINGS = 6, RELAXED_HALVINGS = 12, MAX_STEPS = 1024, LINEAR_STEPS = 64;

struct Traced {
    float distance;  // along the ray, texels
    uint steps;
};

vec3 point(vec2 origin, vec3 direction, float t) {
    precise vec3 at = vec3(origin, relief.depth) + t * direction;
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

// The longest step that the map allows from a point.
float allowed(vec3 at, vec3 direction) {
    ivec2 cell = ivec2(floor(at.xy));
    if (TRACER == DISTANCES) {
        uint layer = min(uint(max(at.z * (float(relief.layers) / relief.depth), 0.0)), relief.layers - 1u);
        return map_texel(layer * relief.side * relief.side + place(cell));
    }
    // The narrowest cone of the corners; the step ends where the ray meets the cone's side.
    vec4 cones = uintBitsToFloat(uvec4(map.words[place(cell)], map.words[place(cell + ivec2(1, 0))],
                                       map.words[place(cell + ivec2(0, 1))], map.words[place(cell + 1)]));
    float cone = min(min(cones.x, cones.y), min(cones.z, cones.w));
    return cone * max(above(at), 0.0) / (length(direction.xy) - cone * direction.z);
}

float halve(vec2 origin, vec3 direction, float above_at, float below_at) {
    uint halvings = HALVINGS;
    if (TRACER == RELAXED_CONES) halvings = RELAXED_HALVINGS;
    for (uint n = 0; n < halvings; n++) {
        precise float middle = 0.5 * (above_at + below_at);
        if (above(point(origin, direction, middle)) > 0.0) above_at = middle; else below_at = middle;
    }
    return below_at;
}

// The first hit of a ray that descends from the top plane.
Traced traced(vec2 origin, vec3 direction) {
    float t = 0.0, fixed_step = -relief.depth / direction.z / float(LINEAR_STEPS);
    uint steps = 0;
    while (steps < MAX_STEPS) {
        float step = TRACER == LINEAR ? fixed_step : allowed(point(origin, direction, t), direction);
        // Guaranteed steps cannot pass the surface; all others are tested.
        bool may_pass = true;
        if (TRACER == DISTANCES) may_pass = step < MIN_STEP;
        if (TRACER != LINEAR) step = max(step, MIN_STEP);
        precise float next = t + step;
        steps++;
        if (may_pass && above(point(origin, direction, next)) <= 0.0) {
            t = halve(origin, direction, t, next);
            break;
        }
        t = next;
    }
    return Traced(t, steps);
}
