// 2^-n, exactly: exp2 may err by some ulp.
float power_of_half(uint n) { return uintBitsToFloat((127u - n) << 23); }
