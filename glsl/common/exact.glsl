// Exactly 2^-n; exp2 may err by a few ulp.
float power_of_half(uint n) { return uintBitsToFloat((127u - n) << 23); }
