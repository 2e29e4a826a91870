// Footprints and levels of published filters (src/paper/texture_mapping/baselines.rs). Needs footprint.glsl. A larger
// footprint raises the level: `max_reach` is the largest distance from the pixel's centre to a sample, or half the box
// of an ellipse, along each axis and in texels of the level.

// A tap of Mavridis and Papaioannou is the mean of at most this many samples.
const uint SAMPLES_A_TAP = 16;

// Trilinear samples along a line through the pixel's centre.
struct Line {
    vec2 reach;  // texels from the middle of the line to its end
    uint taps;
    uint samples_a_tap;
    float level;
    float fall;  // a tap at t * reach, t from -1 to 1, has the weight exp(-fall t^2)
    bool to_the_ends;  // the first and last probe are at the ends; else probes are in the middle of equal parts
};

float raised(float level, float reach, float max_reach) {
    return max(level, ceil(log2(max(reach / max_reach, 1e-30))));
}

// Major and minor semi-axis of the ellipse r <= 1, and the direction of the major one.
vec4 axes_of(vec4 jacobian, float det) {
    vec3 v = spread(jacobian);
    vec2 values = max(eigenvalues(v, det * det), vec2(1e-30));
    vec2 a = vec2(v.y, values.x - v.x);
    vec2 b = vec2(values.x - v.z, v.y);
    vec2 direction = dot(a, a) > dot(b, b) ? a : b;
    direction = dot(direction, direction) > 0.0 ? normalize(direction) : vec2(1.0, 0.0);
    return vec4(sqrt(values), direction);
}

// Rule 0: trilinear; 1: anisotropic; 2: Feline; 3: Mavridis and Papaioannou. `most` samples, probes or taps.
Line line_of(uint rule, uint most, vec4 jacobian, float det, float max_reach) {
    vec2 right = jacobian.xz;
    vec2 down = jacobian.yw;
    float longer = max(length(right), length(down));
    float shorter = min(length(right), length(down));
    vec2 along = length(right) > length(down) ? right : down;
    if (rule == 0) return Line(vec2(0.0), 1, 1, log2(longer), 0.0, false);
    if (rule == 1) {
        uint count = uint(clamp(ceil(longer / shorter), 1.0, float(most)));
        return Line(0.5 * along, count, 1, log2(longer / float(count)), 0.0, false);
    }
    vec4 axes = axes_of(jacobian, det);
    if (rule == 2) {
        uint probes = uint(clamp(floor(2.0 * axes.x / axes.y - 0.5), 1.0, float(most)));
        float minor = max(axes.y, 2.0 * axes.x / float(probes + 1));
        float reach = max(axes.x - minor, 0.0);
        float part = reach / axes.x;
        return Line(reach * axes.zw, probes, 1, raised(log2(minor), reach, max_reach), 2.0 * part * part, true);
    }
    float tap = 2.0 * axes.x / float(most);
    uint samples = uint(clamp(ceil(tap / axes.y), 1.0, float(SAMPLES_A_TAP)));
    float level = raised(log2(max(axes.y, tap / float(samples))), axes.x, max_reach);
    return Line(axes.x * axes.zw, most, samples, level, 2.0, false);
}

// The axes of pbrt-v4's MIPMap::EWA (Pharr, Jakob and Humphreys, "Physically based rendering", 4th edition, section
// 10.4.5), in texels of level 0.
struct PbrtAxes {
    vec2 longer;
    vec2 shorter;
    float level;  // its fraction is the weight of the next coarser level
};

PbrtAxes pbrt_axes(vec4 jacobian, float max_reach) {
    const float max_ratio = 8.0;
    vec2 longer = jacobian.xz;
    vec2 shorter = jacobian.yw;
    if (dot(longer, longer) < dot(shorter, shorter)) {
        vec2 other = longer;
        longer = shorter;
        shorter = other;
    }
    float most = length(longer);
    float least = length(shorter);
    if (least * max_ratio < most && least > 0.0) {
        shorter *= most / (least * max_ratio);
        least = most / max_ratio;
    }
    return PbrtAxes(longer, shorter, raised(log2(max(least, 1e-30)), most + least, max_reach));
}

// The level of single texels at random positions in the ellipse.
float ellipse_taps_level(vec4 jacobian, float det, float max_reach) {
    vec3 v = spread(jacobian);
    float minor = sqrt(eigenvalues(v, det * det).y);
    return raised(floor(log2(max(minor, 1e-30))), sqrt(max(v.x, v.z)), max_reach);
}
