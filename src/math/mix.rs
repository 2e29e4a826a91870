//! Pseudorandom bits of an integer, the same on every machine.

/// A bijection of 32 bits. Each input bit flips each output bit with a probability of about one half: multiply-xorshift
/// with the constants of C. Wellons' "lowbias32" (public domain, 2018).
#[inline(always)]
pub const fn mix(mut bits: u32) -> u32 {
    bits ^= bits >> 16;
    bits = bits.wrapping_mul(0x7feb_352d);
    bits ^= bits >> 15;
    bits = bits.wrapping_mul(0x846c_a68b);
    bits ^ (bits >> 16)
}
