#version 460
// variants FORM: 0 1 2
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "common/view.glsl"

// A plane with a relief below it: relief/surface.rs. Positions are in texels of the relief; texel (i, j) is at (i, j).
// FORM 0 is unlit, 1 is lit; 2 writes the work of a pixel as words, for the window's overlay.
#define LIT (FORM == 1)

layout(constant_id = 1) const uint TRACES = 0;  // 1: traces one ray; 0: filters the footprint (relief_filters.glsl)

layout(binding = 0) uniform sampler2D plain;
layout(binding = 3, scalar) readonly buffer Relief {
    uint side;       // texels
    uint layers;     // of a distance map
    float depth;     // texels
    float map_unit;  // texels per step of a quantised map
    float size_m;    // of the plane
} relief;
layout(binding = 4, scalar) readonly buffer Heights { float texels[]; } heights;
layout(binding = 5, scalar) readonly buffer Map { uint words[]; } map;

layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
#if LIT
layout(location = 2) in vec3 normal;
#include "common/light.glsl"
#endif
#if FORM == 2
layout(location = 0) out uvec4 words;
#else
layout(location = 0) out vec4 colour;
#endif

// Steps of the ray, or texels visited.
float work = 0.0;

#include "texture_mapping/relief_place.glsl"
#include "texture_mapping/relief_heights.glsl"
#include "texture_mapping/relief_ray.glsl"

// If a footprint exceeds MAX_ALONG texels along the view direction or MAX_ACROSS texels across it, the relief counts
// as flat.
const float MAX_ALONG = 64.0, MAX_ACROSS = 16.0;

float height_at(vec2 at) {
    vec2 cell = floor(at), inside = at - cell;
    vec4 of = corners(ivec2(cell));
    vec2 near_far = mix(of.xz, of.yw, inside.x);
    return mix(near_far.x, near_far.y, inside.y);
}

// Slopes to the east and to the south, over two texels: the exact slopes of a bilinear surface jump between cells.
vec2 slopes_at(vec2 at) {
    vec2 step = vec2(1.0, 0.0);
    return 0.5 * vec2(height_at(at + step) - height_at(at - step), height_at(at + step.yx) - height_at(at - step.yx));
}

vec2 to_texture(vec2 at) { return (at + 0.5) / float(relief.side); }

vec3 lit(vec3 albedo, vec2 at) {
#if LIT
    vec2 slopes = slopes_at(at);
    return albedo * light(vec3(-slopes.x, slopes.y, 1.0), view.sun);
#else
    return albedo;
#endif
}

// For the current pixel: the view direction in the plane (lengths along it are in steps), and its perpendicular
// (lengths in texels).
vec2 along, across;
float step_texels;
float colour_level;  // mip level: its texels are as far apart as the steps or the lines, whichever are farther
float steps_down;  // steps along the plane per texel of descent

#define COLOUR vec3
struct Texel {
    float height;
    COLOUR colour;
};

Texel sample_row(int x, float y) {
    vec2 at = float(x) * step_texels * along + y * across;
    return Texel(height_at(at), lit(textureLod(plain, to_texture(at), colour_level).rgb, at));
}

float entry(float x, float height) { return x - (relief.depth - height) * steps_down; }

float descent() { return relief.depth * steps_down; }

float advance(float height) { return (relief.depth - height) * steps_down; }

#include "texture_mapping/relief_filters.glsl"

// The footprint is the rectangle along the view direction that contains the pixel's parallelogram.
vec3 by_footprint(vec2 at, vec3 ray, vec2 dx, vec2 dy) {
    float level_length = length(ray.xy);
    along = level_length > 1e-6 ? ray.xy / level_length : vec2(1.0, 0.0);
    across = vec2(-along.y, along.x);
    vec2 middle = vec2(dot(at, along), dot(at, across));
    vec2 reach = 0.5 * (abs(vec2(dot(dx, along), dot(dx, across))) + abs(vec2(dot(dy, along), dot(dy, across))));
    if (2.0 * reach.x > MAX_ALONG || 2.0 * reach.y > MAX_ACROSS) {
        float side = float(relief.side);
        return lit(textureGrad(plain, to_texture(at), dx / side, dy / side).rgb, at);
    }
    // A step is at most a pixel and at most a texel long. A vertical wall is drawn one step wide, so with longer steps
    // its edge would jump by more than a pixel. Steps are powers of two, so that neighbouring pixels sample the same
    // positions.
    step_texels = exp2(clamp(floor(log2(2.0 * reach.x)), -5.0, 0.0));
    steps_down = level_length / -ray.z / step_texels;
    Sum sum = Sum(vec3(0.0), 0.0, 0.0);
    vec2 start = vec2(middle.x / step_texels, middle.y);
    // Two lines per texel, as in the figures.
    uint lines = max(uint(4.0 * reach.y), 1u);
    float apart = max(step_texels, 2.0 * reach.y / float(lines));
    colour_level = log2(apart * float(textureSize(plain, 0).x) / float(relief.side));
    Span span = span_of((middle.x - reach.x) / step_texels, (middle.x + reach.x) / step_texels, start);
    for (uint n = 0; n < lines; n++) {
        float y = middle.y + ((2.0 * float(n) + 1.0) / float(lines) - 1.0) * reach.y;
        sum = add_line(sum, span, y);
    }
    work = sum.texels;
    // In f32 a very small footprint may have no width.
    if (sum.weight == 0.0) return colour_instead(span, start);
    return sum.colour / sum.weight;
}

// Traces one ray, and filters the texture at its hit with the plane's derivatives (Donnelly, GPU Gems 2, chapter 8).
vec3 by_tracing(vec2 at, vec3 ray, vec2 dx, vec2 dy) {
    Traced found = traced(at, ray);
    work = float(found.steps);
    vec2 hit = at + found.distance * ray.xy;
    float side = float(relief.side);
    return lit(textureGrad(plain, to_texture(hit), dx / side, dy / side).rgb, hit);
}

void main() {
    float side = float(relief.side);
    vec2 place = vec2(triangle_origin) * exp2(-32.0) + from_origin;
    vec2 dx = side * dFdxFine(from_origin), dy = side * dFdyFine(from_origin);
    // A helper invocation, beside an edge of the mesh, only gives derivatives. Its own footprint can be unbounded.
    if (gl_HelperInvocation) return;
    vec2 at = place * side - 0.5;
    // x points east, rows run south.
    vec3 middle = vec3(vec2(0.5 * side - 0.5), 0.0);
    vec3 eye = (view.eye_high + view.eye_low) / relief.size_m * side * vec3(1.0, -1.0, 1.0) + middle;
    vec3 ray = normalize(vec3(at, 0.0) - eye);
    vec3 found;
    if (TRACES == 1) found = by_tracing(at, ray, dx, dy); else found = by_footprint(at, ray, dx, dy);
#if FORM == 2
    words = uvec4(uint(work), 0, 0, 0);
#else
    colour = vec4(found, 1.0);
#endif
}
