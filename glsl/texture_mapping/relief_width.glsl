// Weights texels along the view direction by their visible width: relief/parallax.rs has the method. The including file
// declares a struct Texel with `height` and with `colour` of type COLOUR, and the functions
// `Texel sample_row(int x, float y)`, `float entry(float x, float height)` and `float descent()`. x counts steps along
// the view direction; a step is a texel or a fraction of one. `descent` returns the number of steps from a ray's entry
// through the top plane to height 0.

struct Sum {
    COLOUR colour;  // times weights
    float weight;
    float texels;   // visited
};

// Limits the iterations of a loop. The strides below need fewer iterations.
const uint MAX_TEXELS = 4096;
// A deep relief in an oblique, near view has descents of thousands of steps, nearly all of them hidden. A descent takes
// at most this many of the longest strides. If it has at most this many steps, every stride is one step.
const float MAX_STRIDES = 1024.0;
// A stride of several steps shows at most this share of the footprint.
const float MAX_SHARE = 1.0 / 64.0;

int longest_stride() { return 1 << uint(ceil(clamp(log2(max(descent() / MAX_STRIDES, 1.0)), 0.0, 20.0))); }

// A stride ends at a multiple of its length, so that neighbouring pixels sample the same positions.
int after(int x, int stride) { return (x | (stride - 1)) + 1; }

// The x at which the ray that enters at `s` hits the line of texels at y.
float hit(float s, float y) {
    int x = int(floor(s)), stride = longest_stride();
    float from = entry(float(x), sample_row(x, y).height);
    for (uint n = 0; n < MAX_TEXELS; n++) {
        int next = after(x, stride);
        float to = entry(float(next), sample_row(next, y).height);
        if (to < s) {
            from = to;
            x = next;
        } else if (next == x + 1) {
            return float(x) + (to > from ? clamp((s - from) / (to - from), 0.0, 1.0) : 1.0);
        } else {
            stride /= 2;
        }
    }
    return float(x);
}

// The colour at a hit.
COLOUR colour_at(float x, float y) {
    int before = int(floor(x));
    return mix(sample_row(before, y).colour, sample_row(before + 1, y).colour, x - floor(x));
}

// Adds the segments between texels, weighted by their visible width within the pixel's interval a .. b.
Sum projected(Sum sum, float a, float b, float y) {
    int x = int(floor(a)), longest = longest_stride(), stride = longest;
    Texel from = sample_row(x, y);
    float from_entry = entry(float(x), from.height), seen = max(a, from_entry), most = MAX_SHARE * (b - a);
    for (uint n = 0; n < MAX_TEXELS && seen < b; n++) {
        int next = after(x, stride);
        Texel to = sample_row(next, y);
        float to_entry = entry(float(next), to.height), end = min(to_entry, b);
        sum.texels += 1.0;
        if (end - seen > most && next > x + 1) {
            stride /= 2;
            continue;
        }
        if (end > seen) {
            float middle = (0.5 * (seen + end) - from_entry) / (to_entry - from_entry);
            sum.colour += mix(from.colour, to.colour, middle) * (end - seen);
            sum.weight += end - seen;
        }
        seen = max(seen, end);
        from = to;
        from_entry = to_entry;
        x = next;
        stride = min(2 * stride, longest);
    }
    return sum;
}
