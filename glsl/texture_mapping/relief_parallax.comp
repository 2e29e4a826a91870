#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

// Filters a relief's colours over a pixel of an oblique view: relief/parallax.rs has the methods.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint PARALLAX_FILTER = 0;
const uint POINT = 0, OFFSET = 1, UNPERTURBED = 2, WHOLE = 3, VISIBLE = 4, PROJECTED = 5;

layout(push_constant, scalar) uniform Parallax {
    uint side;         // texels
    float depth;       // texels
    float cotangent;   // cot(elevation): a ray's distance along x per unit of descent
    uint columns;      // pixels along a side of the picture
    float pixel;       // texels along a side of a pixel
} view;

// (height, colour) of each texel.
layout(binding = 0, scalar) readonly buffer Texels { vec2 texels[]; } surface;
// Sum of colours times weights, sum of weights, texels visited.
layout(binding = 1, scalar) writeonly buffer Pixels { vec3 values[]; } pixels;

uint place(ivec2 at) {
    uvec2 inside = uvec2(at) & (view.side - 1u);
    return inside.y * view.side + inside.x;
}

#define COLOUR float
struct Texel {
    float height;
    COLOUR colour;
};

// A texel of column x, interpolated between two rows.
Texel sample_row(int x, float y) {
    int below = int(floor(y));
    vec2 own = mix(surface.texels[place(ivec2(x, below))], surface.texels[place(ivec2(x, below + 1))], y - floor(y));
    return Texel(own.x, own.y);
}

// The x at which the ray that hits this point enters the top plane.
float entry(float x, float height) { return x - (view.depth - height) * view.cotangent; }

float descent() { return view.depth * view.cotangent; }

#include "texture_mapping/relief_width.glsl"

Sum add_texel(Sum sum, Texel texel) { return Sum(sum.colour + texel.colour, sum.weight + 1.0, sum.texels + 1.0); }

// Adds the texels with a <= x < b; with `visible`, only those that the relief does not hide.
Sum box(Sum sum, float a, float b, float y, bool visible) {
    // A texel can only be hidden by texels up to depth * cotangent before it.
    float highest = -3.4e38;
    int first = int(ceil(a));
    if (visible) {
        int reach = int(min(ceil(descent()), float(MOST_TEXELS)));
        for (int x = first - reach; x < first; x++) highest = max(highest, entry(float(x), sample_row(x, y).height));
    }
    for (uint n = 0; n < MOST_TEXELS; n++) {
        int x = first + int(n);
        if (float(x) >= b) break;
        Texel texel = sample_row(x, y);
        float own = entry(float(x), texel.height);
        if (!visible || own >= highest) sum = add_texel(sum, texel); else sum.texels += 1.0;
        highest = max(highest, own);
    }
    return sum;
}

// The x at which a ray that enters at `s` would hit a flat surface with the height at `s`.
float below(float s, float y) {
    int before = int(floor(s));
    float height = mix(sample_row(before, y).height, sample_row(before + 1, y).height, s - floor(s));
    return s + (view.depth - height) * view.cotangent;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, uvec2(view.columns)))) return;
    vec2 corner = vec2(pixel) * view.pixel, middle = corner + 0.5 * view.pixel;
    float a = corner.x, b = corner.x + view.pixel;
    float centre = PARALLAX_FILTER == OFFSET ? below(middle.x, middle.y) : hit(middle.x, middle.y);
    bool moved = PARALLAX_FILTER == UNPERTURBED;
    if (PARALLAX_FILTER == OFFSET) moved = true;
    if (moved) {
        a = centre - 0.5 * view.pixel;
        b = centre + 0.5 * view.pixel;
    } else if (PARALLAX_FILTER != PROJECTED) {
        a = hit(a, middle.y);
        b = hit(b, middle.y);
    }
    Sum sum = Sum(0.0, 0.0, 0.0);
    // Two lines per texel: one would miss half of a slope between two rows of texels.
    uint rows = max(uint(2.0 * view.pixel), 1u);
    for (uint n = 0; n < rows; n++) {
        float y = corner.y + (float(n) + 0.5) * view.pixel / float(rows);
        if (PARALLAX_FILTER == PROJECTED) sum = projected(sum, a, b, y);
        if (moved) sum = box(sum, a, b, y, false);
        if (PARALLAX_FILTER == WHOLE) sum = box(sum, a, b, y, false);
        if (PARALLAX_FILTER == VISIBLE) sum = box(sum, a, b, y, true);
    }
    // A footprint without a visible texel shows the colour at the centre ray's hit.
    if (sum.weight == 0.0) sum = Sum(colour_at(centre, middle.y), 1.0, sum.texels + 2.0);
    pixels.values[pixel.y * view.columns + pixel.x] = vec3(sum.colour, sum.weight, sum.texels);
}
