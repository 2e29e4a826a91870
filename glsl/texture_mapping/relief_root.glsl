// The largest float whose square, rounded, is not above `square`: the same on every device, whatever its sqrt.
float exact_root(float square) {
    if (square < 1.17549435e-38) return 0.0;
    float root = sqrt(square);
    // A sqrt is a few ulp wrong at most.
    for (uint n = 0; n < 16u; n++) {
        precise float own = root * root;
        if (own <= square) break;
        root = uintBitsToFloat(floatBitsToUint(root) - 1u);
    }
    for (uint n = 0; n < 16u; n++) {
        float above = uintBitsToFloat(floatBitsToUint(root) + 1u);
        precise float own = above * above;
        if (own > square) break;
        root = above;
    }
    return root;
}
