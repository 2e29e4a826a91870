// Makes vertices arbitrarily expensive, for figures that need a vertex-bound frame.
layout(constant_id = 0) const uint VERTEX_WORK = 0;  // rounds of two multiplications and a subtraction

// Returns the position unchanged. The logistic map stays in 0 ..= 1, but a compiler cannot prove this.
vec3 worked(vec3 position) {
    if (VERTEX_WORK == 0) {
        return position;
    }
    float x = fract(position.x);
    for (uint n = 0; n < VERTEX_WORK; n++) {
        x = 3.9 * x * (1.0 - x);
    }
    return position + vec3(x > 2.0 ? 1.0 : 0.0);
}
