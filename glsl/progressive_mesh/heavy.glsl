// Makes vertices as expensive as one likes: for figures in which they are to be the bottleneck.
layout(constant_id = 0) const uint VERTEX_WORK = 0;  // rounds of three multiplications

// The position itself. The logistic map stays in 0 ..= 1, which no compiler knows.
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
