// Steps B and C of paper 3: the weight of a texel.
layout(constant_id = 58) const float ALPHA = 2.0;
layout(constant_id = 59) const uint EDGE = 5;  // the index of the variant of `Edge` (weights.rs)

// Step B: the weight at a position in the unit disc.
float gaussian(vec2 at) {
    return ALPHA == 0.0 ? 1.0 : exp(-ALPHA * dot(at, at));
}

// The error function of x >= 0, with an error of at most 1.5e-7 (Abramowitz and Stegun, "Handbook of mathematical
// functions", 7.1.26).
float erf_of(float x) {
    float t = 1.0 / (1.0 + 0.3275911 * x);
    float sum = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
    return 1.0 - sum * exp(-x * x);
}

// Step C: the part of a texel that is inside the ellipse's edge. `signed_distance`: from the edge to the texel's centre
// in texels, positive inside.
float kept(float signed_distance) {
    if (EDGE == 0) return signed_distance >= 0.0 ? 1.0 : 0.0;
    float d = abs(signed_distance);
    float inside;
    if (EDGE == 1) inside = 0.5 + 0.5 * erf_of(min(d, 2.0) * 3.5355339);  // 1 / (0.2 sqrt 2)
    else if (d >= 0.5) inside = 1.0;
    else if (EDGE == 2) inside = 0.5 + d * (2.151 - 2.358 * d);
    else if (EDGE == 3) inside = 0.496 + d * (2.288 + d * (-3.074 + 0.956 * d));
    else if (EDGE == 4) inside = d < 0.165 ? 0.506 + 1.79 * d : d < 0.305 ? 0.636 + 1.008 * d : 0.853 + 0.295 * d;
    else inside = 0.5 + d;
    if (signed_distance >= 0.0) return inside;
    return d < 0.5 ? 1.0 - inside : 0.0;
}
