// The filters of a relief's footprint along the view direction: `ParallaxFilter` (relief/parallax.rs). Needs the
// declarations of relief_width.glsl, and `float advance(float height)`: the number of texels along x that a ray
// advances from its entry until it has descended to `height`.
layout(constant_id = 0) const uint PARALLAX_FILTER = 5;
const uint POINT = 0, OFFSET = 1, UNPERTURBED = 2, WHOLE = 3, VISIBLE = 4, PROJECTED = 5;

#include "texture_mapping/relief_width.glsl"

Sum add_texel(Sum sum, Texel texel) { return Sum(sum.colour + texel.colour, sum.weight + 1.0, sum.texels + 1.0); }

// Adds the texels with a <= x < b; with `visible`, only those that the relief does not hide.
Sum box(Sum sum, float a, float b, float y, bool visible) {
    // A texel can only be hidden by texels up to depth * cotangent before it.
    float highest = -3.4e38;
    int first = int(ceil(a));
    if (visible) {
        int reach = int(min(ceil(descent()), float(MAX_TEXELS)));
        for (int x = first - reach; x < first; x++) highest = max(highest, entry(float(x), sample_row(x, y).height));
    }
    for (uint n = 0; n < MAX_TEXELS; n++) {
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
    return s + advance(height);
}

// What a filter sums for a pixel: the texels with a <= x < b on each line; with the projected width, the texels that
// are hit by rays that enter between a and b. `centre`: the hit of the centre's ray, not used by the projected width.
struct Span {
    float a, b, centre;
};

// The span of a pixel whose rays enter from `a` to `b`; `middle` is the pixel's centre.
Span span_of(float a, float b, vec2 middle) {
    if (PARALLAX_FILTER == PROJECTED) return Span(a, b, middle.x);
    if (PARALLAX_FILTER == OFFSET) {
        float centre = below(middle.x, middle.y);
        return Span(centre - 0.5 * (b - a), centre + 0.5 * (b - a), centre);
    }
    float centre = hit(middle.x, middle.y);
    if (PARALLAX_FILTER == UNPERTURBED) return Span(centre - 0.5 * (b - a), centre + 0.5 * (b - a), centre);
    return Span(hit(a, middle.y), hit(b, middle.y), centre);
}

// Adds one line of texels.
Sum add_line(Sum sum, Span span, float y) {
    if (PARALLAX_FILTER == POINT) return sum;
    if (PARALLAX_FILTER == PROJECTED) return projected(sum, span.a, span.b, y);
    bool visible = PARALLAX_FILTER == VISIBLE;
    return box(sum, span.a, span.b, y, visible);
}

// The colour of a footprint without a visible texel: the colour at the centre ray's hit.
COLOUR colour_instead(Span span, vec2 middle) {
    float centre = span.centre;
    if (PARALLAX_FILTER == PROJECTED) centre = hit(middle.x, middle.y);
    return colour_at(centre, middle.y);
}
