//! Deterministic pseudorandom numbers, the same on every machine: SplitMix64 (Steele, Lea and Flood, "Fast
//! splittable pseudorandom number generators", 2014).

const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// A sequence determined by its seed.
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    pub fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(STEP);
        let bits = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ bits >> 31
    }

    /// A number from 0 to `bound` - 1.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.draw() % bound as u64) as usize
    }

    /// A number of 53 bits in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.draw() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A random order (Fisher-Yates shuffle).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        (1..items.len()).rev().for_each(|at| items.swap(at, self.below(at + 1)));
    }

    /// Number `n` (from 0) of the sequence of `seed`.
    pub fn nth(seed: u64, n: u64) -> u64 {
        SplitMix64(seed.wrapping_add(n.wrapping_mul(STEP))).draw()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_is_the_published_one() {
        // The generator's reference implementation (S. Vigna, public domain) with seed 1234567.
        let expected = [
            6_457_827_717_110_365_317_u64,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
        ];
        let mut sequence = SplitMix64(1_234_567);
        for (n, expected) in expected.into_iter().enumerate() {
            assert_eq!((sequence.draw(), SplitMix64::nth(1_234_567, n as u64)), (expected, expected));
        }
    }
}
