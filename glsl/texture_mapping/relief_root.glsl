// The largest float whose rounded square is at most `square`. Every device finds the same float, however the device
// rounds sqrt.
float exact_root(float square) {
    if (square < 1.17549435e-38) return 0.0;
    float root = sqrt(square);
    // The error of sqrt is a few ulp at most.
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
