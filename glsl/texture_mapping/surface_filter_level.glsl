// The filter of a surface, and the levels of paper 3's published filters. Needs footprint.glsl and baseline_level.glsl.
layout(constant_id = 5) const uint MAX_ANISOTROPY = 1;  // NA: most samples or probes, number of taps, or ratio of axes
layout(constant_id = 17) const uint FILTER = 0;         // the index of the variant of `Filtering` (choices.rs):
const uint TRILINEAR = 0, BILINEAR = 1, STOCHASTIC = 2, ELLIPSE = 3;
const uint FELINE = 4, MAVRIDIS = 5, PBRT = 6, ELLIPSE_TAPS = 7;

layout(constant_id = 18) const uint SAMPLES = 1;        // taps per pixel of the stochastic filters
layout(constant_id = 19) const uint BOUNDS_LIMB = 0;    // 1: bounds footprints at a sphere's limb (footprint.glsl)

// True for the ellipse and the published filters. It compares a variable, because the build script
// evaluates only == and != in constant expressions.
bool is_of_paper_3() {
    uint kind = FILTER;
    return kind >= ELLIPSE;
}

// True for filters of paper 3 that read two levels.
bool reads_two_levels() {
    if (FILTER == FELINE) return true;
    if (FILTER == MAVRIDIS) return true;
    return FILTER == PBRT;
}

Line line_of(vec4 jacobian, float det, float max_reach) {
    uint rule = 3;
    if (FILTER == FELINE) rule = 2;
    return line_of(rule, MAX_ANISOTROPY, jacobian, det, max_reach);
}

// The level of a published filter; its fraction is the weight of the next coarser one.
float baseline_level(vec4 jacobian, float det, float max_reach, uint coarsest) {
    // The condition also holds for a footprint that is not finite.
    if (!(dot(jacobian, jacobian) < MAX_MAJOR_TEXELS * MAX_MAJOR_TEXELS)) return float(coarsest);
    float level = FILTER == PBRT         ? pbrt_axes(jacobian, max_reach).level
                : FILTER == ELLIPSE_TAPS ? ellipse_taps_level(jacobian, det, max_reach)
                                         : line_of(jacobian, det, max_reach).level;
    return clamp(level, 0.0, float(coarsest));
}

// Half sides of a box around the pixel's centre that holds all texels which the filter reads, in texels of a level. A
// sample reads texels up to 3 texels away, because texels of the next coarser level are 2 texels wide.
vec2 baseline_half_sides(vec4 jacobian, float det, float max_reach, uint level) {
    float scale = power_of_half(level);
    if (FILTER == ELLIPSE_TAPS) return sqrt(spread(jacobian).xz) * scale + 0.5;
    if (FILTER != PBRT) return abs(line_of(jacobian, det, max_reach).reach) * scale + 3.0;
    PbrtAxes axes = pbrt_axes(jacobian, max_reach);
    return sqrt((axes.longer * axes.longer + axes.shorter * axes.shorter) * (scale * scale) + 4.0) + 1.0;
}
