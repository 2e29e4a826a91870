#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

// A relief's colour filtered over a pixel that sees it at an angle: relief/parallax.rs has the methods.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint METHOD = 0;
const uint POINT = 0, UNPERTURBED = 1, WHOLE = 2, VISIBLE = 3, PROJECTED = 4;
const uint MOST_TEXELS = 1024;  // of a row of texels

layout(push_constant, scalar) uniform Parallax {
    uint side;         // texels
    float depth;       // texels
    float cotangent;   // of the elevation: how far a ray goes along x while it descends by one
    uint columns;      // pixels a side
    float pixel;       // texels a side
} view;

// (height, colour) of each texel.
layout(binding = 0, scalar) readonly buffer Texels { vec2 texels[]; } surface;
// Sum of colours times weights, sum of weights, texels looked at.
layout(binding = 1, scalar) writeonly buffer Pixels { vec3 values[]; } pixels;

uint place(ivec2 at) {
    uvec2 inside = uvec2(at) & (view.side - 1u);
    return inside.y * view.side + inside.x;
}

// Height and colour between two rows of texels.
vec2 sample_row(int x, float y) {
    int below = int(floor(y));
    return mix(surface.texels[place(ivec2(x, below))], surface.texels[place(ivec2(x, below + 1))], y - floor(y));
}

// Where a ray that shows a point enters the top plane.
float entry(float x, float height) { return x - (view.depth - height) * view.cotangent; }

// The x at which the ray that enters at `s` meets the row.
float hit(float s, float y) {
    int x = int(floor(s));
    float from = entry(float(x), sample_row(x, y).x);
    for (uint n = 0; n < MOST_TEXELS; n++) {
        float to = entry(float(x + 1), sample_row(x + 1, y).x);
        if (to >= s) return float(x) + (to > from ? clamp((s - from) / (to - from), 0.0, 1.0) : 1.0);
        from = to;
        x++;
    }
    return float(x);
}

vec3 add_texel(vec3 sum, int x, float y) { return sum + vec3(sample_row(x, y).y, 1.0, 1.0); }

// Texels of a <= x < b; with `visible` those that the relief does not hide.
vec3 box(vec3 sum, float a, float b, float y, bool visible) {
    // Whatever hides a texel lies within the depth's reach before it.
    float highest = -3.4e38;
    int first = int(ceil(a));
    if (visible) {
        int reach = int(min(ceil(view.depth * view.cotangent), float(MOST_TEXELS)));
        for (int x = first - reach; x < first; x++) highest = max(highest, entry(float(x), sample_row(x, y).x));
    }
    for (uint n = 0; n < MOST_TEXELS; n++) {
        int x = first + int(n);
        if (float(x) >= b) break;
        float own = entry(float(x), sample_row(x, y).x);
        if (!visible || own >= highest) sum = add_texel(sum, x, y); else sum.z += 1.0;
        highest = max(highest, own);
    }
    return sum;
}

// Segments between texels, weighted by their visible width on the pixel's part a .. b of the screen.
vec3 projected(vec3 sum, float a, float b, float y) {
    int x = int(floor(a));
    vec2 from = sample_row(x, y);
    float from_entry = entry(float(x), from.x), seen = max(a, from_entry);
    for (uint n = 0; n < MOST_TEXELS && seen < b; n++) {
        vec2 to = sample_row(x + 1, y);
        float to_entry = entry(float(x + 1), to.x), end = min(to_entry, b);
        if (end > seen) {
            float middle = (0.5 * (seen + end) - from_entry) / (to_entry - from_entry);
            sum += vec3(mix(from.y, to.y, middle) * (end - seen), end - seen, 0.0);
        }
        seen = max(seen, end);
        sum.z += 1.0;
        from = to;
        from_entry = to_entry;
        x++;
    }
    return sum;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, uvec2(view.columns)))) return;
    vec2 corner = vec2(pixel) * view.pixel, middle = corner + 0.5 * view.pixel;
    float a = corner.x, b = corner.x + view.pixel, centre = hit(middle.x, middle.y);
    if (METHOD == UNPERTURBED) {
        a = centre - 0.5 * view.pixel;
        b = centre + 0.5 * view.pixel;
    } else if (METHOD != PROJECTED) {
        a = hit(a, middle.y);
        b = hit(b, middle.y);
    }
    vec3 sum = vec3(0.0);
    // Two rows a texel: one would miss half of a slope between two rows of texels.
    uint rows = max(uint(2.0 * view.pixel), 1u);
    for (uint n = 0; n < rows; n++) {
        float y = corner.y + (float(n) + 0.5) * view.pixel / float(rows);
        if (METHOD == PROJECTED) sum = projected(sum, a, b, y);
        if (METHOD == UNPERTURBED) sum = box(sum, a, b, y, false);
        if (METHOD == WHOLE) sum = box(sum, a, b, y, false);
        if (METHOD == VISIBLE) sum = box(sum, a, b, y, true);
    }
    // A footprint between texels, and one whose texels are all hidden, show the centre's.
    if (sum.y == 0.0) {
        int x = int(floor(centre));
        float between = centre - floor(centre);
        sum += vec3(mix(sample_row(x, middle.y).y, sample_row(x + 1, middle.y).y, between), 1.0, 2.0);
    }
    pixels.values[pixel.y * view.columns + pixel.x] = sum;
}
