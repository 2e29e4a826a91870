// Weights texels along the view direction by their visible width: relief/parallax.rs has the method. Needs a struct
// Texel with `height` and `colour` of type COLOUR, `Texel sample_row(int x, float y)`, `MOST_TEXELS`, and `float
// entry(float x, float height)`.

struct Sum {
    COLOUR colour;  // times weights
    float weight;
    float texels;   // visited
};

// The x at which the ray that enters at `s` hits the line of texels at y.
float hit(float s, float y) {
    int x = int(floor(s));
    float from = entry(float(x), sample_row(x, y).height);
    for (uint n = 0; n < MOST_TEXELS; n++) {
        float to = entry(float(x + 1), sample_row(x + 1, y).height);
        if (to >= s) return float(x) + (to > from ? clamp((s - from) / (to - from), 0.0, 1.0) : 1.0);
        from = to;
        x++;
    }
    return float(x);
}

// Adds the segments between texels, weighted by their visible width within the pixel's interval a .. b.
Sum projected(Sum sum, float a, float b, float y) {
    int x = int(floor(a));
    Texel from = sample_row(x, y);
    float from_entry = entry(float(x), from.height), seen = max(a, from_entry);
    for (uint n = 0; n < MOST_TEXELS && seen < b; n++) {
        Texel to = sample_row(x + 1, y);
        float to_entry = entry(float(x + 1), to.height), end = min(to_entry, b);
        if (end > seen) {
            float middle = (0.5 * (seen + end) - from_entry) / (to_entry - from_entry);
            sum.colour += mix(from.colour, to.colour, middle) * (end - seen);
            sum.weight += end - seen;
        }
        seen = max(seen, end);
        sum.texels += 1.0;
        from = to;
        from_entry = to_entry;
        x++;
    }
    return sum;
}
