#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

// Filters a relief's colours over a pixel of an oblique view: relief/parallax.rs has the methods.
layout(local_size_x = 8, local_size_y = 8) in;

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

float advance(float height) { return (view.depth - height) * view.cotangent; }

#include "texture_mapping/relief_filters.glsl"

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, uvec2(view.columns)))) return;
    vec2 corner = vec2(pixel) * view.pixel, middle = corner + 0.5 * view.pixel;
    Span span = span_of(corner.x, corner.x + view.pixel, middle);
    Sum sum = Sum(0.0, 0.0, 0.0);
    // Two lines per texel: one would miss half of a slope between two rows of texels.
    uint rows = max(uint(2.0 * view.pixel), 1u);
    for (uint n = 0; n < rows; n++)
        sum = add_line(sum, span, corner.y + (float(n) + 0.5) * view.pixel / float(rows));
    if (sum.weight == 0.0) sum = Sum(colour_instead(span, middle), 1.0, sum.texels + 2.0);
    pixels.values[pixel.y * view.columns + pixel.x] = vec3(sum.colour, sum.weight, sum.texels);
}
