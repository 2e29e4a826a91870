// Step A of paper 3: the ellipse that filters a footprint, and its level of detail. Needs footprint.glsl and
// weights.glsl. The defaults are those of `EllipseFilter::BEST`. Figures specialize every constant, surfaces every
// constant but MAX_VISITED and K_OF_LEVEL_0.
layout(constant_id = 50) const uint ALL_POSITIVE = 1;
layout(constant_id = 51) const float K = 0.8;
layout(constant_id = 52) const uint ROW_SPAN = 1;
layout(constant_id = 53) const float MINOR_TEXELS = 1.0;
layout(constant_id = 54) const float RADIUS = 1.0;
layout(constant_id = 55) const float MAX_VISITED = 16384.0;
layout(constant_id = 56) const uint K_OF_LEVEL_0 = 1;  // `KTexels::OfLevel0`

struct Ellipse {
    vec3 v;
    float det;
    float minor;  // the squared minor semi-axis
    float k;      // the part of the diagonal entries that is the reconstruction term
};

// The ellipse of a footprint in texels of level 0, without the reconstruction term.
Ellipse ellipse_of(vec4 jacobian, float jacobian_det, float max_ratio) {
    vec3 v = spread(jacobian * RADIUS);
    float det = jacobian_det * (RADIUS * RADIUS);
    det *= det;
    v = widened(v, det, max_ratio);
    return Ellipse(v, det, eigenvalues(v, det).y, 0.0);
}

// `max_reach`: the largest allowed distance from the ellipse's centre to a side of its bounding box, in texels of the
// returned level, without the reconstruction term.
uint ellipse_level(Ellipse finest, float max_reach, uint coarsest) {
    vec3 v = finest.v;
    if (!(v.x + v.z < MAX_MAJOR_TEXELS * MAX_MAJOR_TEXELS)) return coarsest;
    float wanted = MINOR_TEXELS > 0.0 ? floor(log2(sqrt(max(finest.minor, 1e-30)) / MINOR_TEXELS)) : 0.0;
    float visited = ROW_SPAN == 1 ? 4.0 * sqrt(finest.det) : 4.0 * sqrt(v.x * v.z);
    wanted = max(wanted, ceil(0.5 * log2(max(4.0 * visited / MAX_VISITED, 1e-30))));
    wanted = max(wanted, ceil(log2(max(sqrt(max(v.x, v.z)) / max_reach, 1e-30))));
    return uint(clamp(wanted, 0.0, float(coarsest)));
}

// The reconstruction term in squared texels of a level (`FootprintSettings::k_at`). `minor` is the squared minor
// semi-axis without the term. K - minor may cancel, but only where minor + k is K.
float k_at(float scale, float minor) { return K_OF_LEVEL_0 == 0 ? K : max(K * scale, K - minor); }

// The ellipse in texels of a level, with the reconstruction term.
Ellipse at_level(Ellipse finest, uint level) {
    float scale = power_of_half(level) * power_of_half(level);
    vec3 v = finest.v * scale;
    float minor = finest.minor * scale, k = k_at(scale, minor);
    // det(V + k I), expanded into positive terms so that nothing cancels.
    float det = finest.det * (scale * scale) + k * (v.x + v.z) + k * k;
    v += vec3(k, 0.0, k);
    if (ALL_POSITIVE == 0) det = v.x * v.z - v.y * v.y;
    return Ellipse(v, det, minor + k, k);
}

// An ellipse that contains the centre of every texel that may have a weight above 0, including texels that the edge
// cuts (`kept`). It contains the Minkowski sum of the ellipse `of` and a disc with a radius of half a texel.
Ellipse outer(Ellipse of) {
    // The margin keeps texels on the edge that rounding would put outside.
    if (EDGE == 0) return Ellipse(of.v * 1.0001, of.det * 1.0002, of.minor * 1.0001, of.k);
    float t = 2.0 * sqrt(of.minor);
    float a = 1.0 + 1.0 / t;
    float b = 0.25 * (1.0 + t);
    float det = a * a * of.det + a * b * (of.v.x + of.v.z) + b * b;
    return Ellipse(of.v * a + vec3(b, 0.0, b), det, of.minor * a + b, of.k);
}
