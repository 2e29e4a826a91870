//! Entropy coding: an adaptive binary range coder (Martin 1979; carries as in LZMA).
//!
//! Differs from LZMA: probabilities are estimated from counts (after Krichevsky and Trofimov) instead of at a constant
//! rate. A mesh of a few thousand faces ends before constant rates adapt.
//!
//! One trait covers both directions, so that each rule of the format is written once. The encoder takes a
//! value and returns it; the decoder ignores the value and returns what it reads.

/// The adaptive probability of a one, estimated from earlier bits of the same kind.
#[derive(Clone, Copy)]
pub(super) struct Bit {
    /// The probability in 65536ths.
    one: u16,
    /// Bits seen, at most [`MEMORY`].
    seen: u8,
}

/// A probability averages about this many bits: more bits estimate it more finely, fewer adapt faster.
const MEMORY: u8 = 60;
/// Step towards the latest bit, in 65536ths of the distance: 1 / (seen + 3/2).
const STEPS: [u32; MEMORY as usize + 1] = {
    let mut steps = [0; MEMORY as usize + 1];
    let mut seen = 0;
    while seen <= MEMORY as usize {
        steps[seen] = 2 * 65536 / (2 * seen as u32 + 3);
        seen += 1;
    }
    steps
};
/// Bits of precision of a probability in the coder.
const SCALE_BITS: u32 = 12;
/// Smallest probability, in 4096ths. A bit therefore costs at least 0.011 bits, and n bytes encode at most
/// 710 n bits. This bounds the time to read a hostile file.
const MIN: u32 = 32;
/// If the range is smaller than this, it is extended by a byte.
const SMALLEST_RANGE: u32 = 1 << 24;

impl Default for Bit {
    fn default() -> Self {
        Self { one: 1 << 15, seen: 0 }
    }
}

impl Bit {
    fn probability(self) -> u32 {
        (u32::from(self.one) >> (16 - SCALE_BITS)).clamp(MIN, (1 << SCALE_BITS) - MIN)
    }

    fn learn(&mut self, bit: bool) {
        let (one, step) = (u32::from(self.one), STEPS[usize::from(self.seen)]);
        let learnt = if bit { one + (((65535 - one) * step) >> 16) } else { one - ((one * step) >> 16) };
        // Stays between 0 and 65535, because a step is shorter than the distance.
        self.one = learnt as u16;
        self.seen = MEMORY.min(self.seen + 1);
    }
}

/// The operations that encoder and decoder share.
pub(super) trait Coder {
    /// Codes one bit with its model.
    fn bit(&mut self, model: &mut Bit, value: bool) -> bool;
    /// Codes the lowest `bits` bits of a value without a model; at most 32.
    fn raw(&mut self, bits: u32, value: u32) -> u32;
    /// Bits written or read so far, including fractions.
    fn spent_bits(&self) -> f64;
    /// True if the decoder has read beyond the end of the data.
    fn is_overrun(&self) -> bool;
}

/// Writes bits.
pub(super) struct Encoder {
    low: u64,
    range: u32,
    /// The last byte that a carry can still change; `full` counts the bytes of 255 after it.
    held: u8,
    full: u64,
    shifts: u64,
    bytes: Vec<u8>,
}

impl Encoder {
    pub(super) fn new() -> Self {
        Self { low: 0, range: u32::MAX, held: 0, full: 0, shifts: 0, bytes: Vec::new() }
    }

    fn shift(&mut self) {
        let carry = (self.low >> 32) as u8;
        if self.low < 0xff00_0000 || carry == 1 {
            // The byte before the first is always 0 and is not stored.
            if self.shifts > self.full {
                self.bytes.push(self.held.wrapping_add(carry));
            }
            self.bytes.extend((0..self.full).map(|_| 0xff_u8.wrapping_add(carry)));
            self.full = 0;
            self.held = (self.low >> 24) as u8;
        } else {
            self.full += 1;
        }
        self.shifts += 1;
        self.low = (self.low & 0x00ff_ffff) << 8;
    }

    fn normalise(&mut self) {
        while self.range < SMALLEST_RANGE {
            self.range <<= 8;
            self.shift();
        }
    }

    /// All bytes. The decoder reads exactly these.
    pub(super) fn finish(mut self) -> Vec<u8> {
        (0..5).for_each(|_| self.shift());
        self.bytes
    }
}

impl Coder for Encoder {
    #[inline]
    fn bit(&mut self, model: &mut Bit, value: bool) -> bool {
        let bound = (self.range >> SCALE_BITS) * model.probability();
        if value {
            self.range = bound;
        } else {
            self.low += u64::from(bound);
            self.range -= bound;
        }
        self.normalise();
        model.learn(value);
        value
    }

    fn raw(&mut self, bits: u32, value: u32) -> u32 {
        for at in (0..bits).rev() {
            self.range >>= 1;
            if value >> at & 1 == 1 {
                self.low += u64::from(self.range);
            }
            self.normalise();
        }
        value
    }

    fn spent_bits(&self) -> f64 {
        spent_bits(self.shifts, self.range)
    }

    fn is_overrun(&self) -> bool {
        false
    }
}

/// Reads bits.
pub(super) struct Decoder<'a> {
    bytes: &'a [u8],
    /// Number of bytes read. It may exceed the length of the data; bytes beyond the end read as zeros.
    at: usize,
    code: u32,
    range: u32,
}

impl<'a> Decoder<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let mut decoder = Self { bytes, at: 0, code: 0, range: u32::MAX };
        (0..4).for_each(|_| decoder.shift());
        decoder
    }

    fn shift(&mut self) {
        self.code = self.code << 8 | u32::from(self.bytes.get(self.at).copied().unwrap_or(0));
        self.at += 1;
    }

    fn normalise(&mut self) {
        while self.range < SMALLEST_RANGE {
            self.range <<= 8;
            self.shift();
        }
    }

    /// The unread bytes.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at.min(self.bytes.len())..]
    }
}

impl Coder for Decoder<'_> {
    #[inline]
    fn bit(&mut self, model: &mut Bit, _: bool) -> bool {
        let bound = (self.range >> SCALE_BITS) * model.probability();
        let value = self.code < bound;
        if value {
            self.range = bound;
        } else {
            self.code -= bound;
            self.range -= bound;
        }
        self.normalise();
        model.learn(value);
        value
    }

    fn raw(&mut self, bits: u32, _: u32) -> u32 {
        let mut value = 0;
        for _ in 0..bits {
            self.range >>= 1;
            let bit = self.code >= self.range;
            self.code -= if bit { self.range } else { 0 };
            value = value << 1 | u32::from(bit);
            self.normalise();
        }
        value
    }

    fn spent_bits(&self) -> f64 {
        spent_bits(self.at as u64 - 4, self.range)
    }

    fn is_overrun(&self) -> bool {
        self.at > self.bytes.len()
    }
}

/// Each shift is 8 bits; the range gives the fraction of the last bits.
fn spent_bits(shifts: u64, range: u32) -> f64 {
    8.0 * shifts as f64 + 32.0 - f64::from(range).log2()
}

/// Model of whole numbers; small and frequent numbers take few bits. A number is coded as its bit length (a tree of six
/// modelled bits), the three modelled bits below the leading bit, and the remaining bits without a model.
#[derive(Clone)]
pub(super) struct Number {
    class: [Bit; 64],
    /// For each class, the three bits as a tree.
    leading: [[Bit; 8]; 33],
}

/// Number of modelled bits below the leading bit.
const LEARNT: u32 = 3;

impl Default for Number {
    /// Not inlined: the stores for all numbers of a file would be one block, for which LLVM takes minutes.
    #[inline(never)]
    fn default() -> Self {
        Self { class: [Bit::default(); 64], leading: [[Bit::default(); 8]; 33] }
    }
}

impl Number {
    pub(super) fn code(&mut self, coder: &mut impl Coder, value: u32) -> u32 {
        // No encoder writes a class above 32; a hostile file may.
        let class = tree(coder, &mut self.class, 6, 32 - value.leading_zeros()).min(32);
        if class < 2 {
            return class;
        }
        let learnt = LEARNT.min(class - 1);
        let rest = class - 1 - learnt;
        let below = value & ((1_u64 << (class - 1)) - 1) as u32;
        let high = tree(coder, &mut self.leading[class as usize], learnt, below >> rest);
        let low = coder.raw(rest, below & ((1 << rest) - 1));
        1 << (class - 1) | high << rest | low
    }

    /// Codes a difference modulo 2^32. The order of codes is 0, -1, 1, -2, …
    pub(super) fn code_signed(&mut self, coder: &mut impl Coder, value: i32) -> i32 {
        let folded = self.code(coder, (value << 1 ^ value >> 31) as u32);
        (folded >> 1) as i32 ^ -((folded & 1) as i32)
    }
}

/// Codes `bits` bits, highest first. Each bit's model is selected by the bits before it.
pub(super) fn tree(coder: &mut impl Coder, models: &mut [Bit], bits: u32, value: u32) -> u32 {
    let node = (0..bits).rev().fold(1, |node, at| {
        let bit = coder.bit(&mut models[node as usize], value >> at & 1 == 1);
        node << 1 | u32::from(bit)
    });
    node - (1 << bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of all sizes, some of them frequent.
    fn numbers() -> Vec<u32> {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state
        };
        let edges = [0, 1, 2, 3, u32::MAX, u32::MAX - 1, 1 << 31, (1 << 31) - 1];
        let any = (0..20_000).map(|n| if n % 3 == 0 { random() >> (random() >> 27) } else { n % 2 });
        edges.into_iter().chain(any).collect()
    }

    #[test]
    fn numbers_come_back_and_both_sides_count_the_same_bits() {
        let (mut encoder, mut model) = (Encoder::new(), Number::default());
        for &number in &numbers() {
            model.code(&mut encoder, number);
            model.code_signed(&mut encoder, number as i32);
        }
        let spent = encoder.spent_bits();
        let bytes = encoder.finish();
        let (mut decoder, mut model) = (Decoder::new(&bytes), Number::default());
        for &number in &numbers() {
            assert_eq!(model.code(&mut decoder, 0), number);
            assert_eq!(model.code_signed(&mut decoder, 0), number as i32);
        }
        assert!(decoder.rest().is_empty() && !decoder.is_overrun());
        assert_eq!(spent, decoder.spent_bits());
        let stored = 8.0 * bytes.len() as f64;
        assert!(spent <= stored && stored < spent + 48.0, "{spent} bits spent, {stored} stored");
    }

    #[test]
    fn a_rare_bit_costs_little_but_more_than_zero() {
        let (mut encoder, mut model) = (Encoder::new(), Bit::default());
        (0..100_000).for_each(|_| assert!(!encoder.bit(&mut model, false)));
        let each = encoder.spent_bits() / 100_000.0;
        assert!((0.011..0.012).contains(&each), "{each} bits per bit");
    }

    #[test]
    fn a_carry_runs_through_bytes_of_255() {
        // Groups of eight 1 bits, and every 1000th group eight 0 bits: long runs of 255, then a carry.
        let bits: Vec<u32> = (0..4000).map(|n| u32::from(n % 1000 != 999)).collect();
        let mut encoder = Encoder::new();
        for &bit in &bits {
            encoder.raw(1, bit);
            encoder.raw(7, 127 * bit);
        }
        let bytes = encoder.finish();
        let mut decoder = Decoder::new(&bytes);
        for &bit in &bits {
            assert_eq!((decoder.raw(1, 0), decoder.raw(7, 0)), (bit, 127 * bit));
        }
    }

    #[test]
    fn reading_past_the_end_is_detected() {
        let mut decoder = Decoder::new(&[1, 2, 3, 4]);
        decoder.raw(7, 0);
        assert!(!decoder.is_overrun());
        decoder.raw(8, 0);
        assert!(decoder.is_overrun());
        assert!(Decoder::new(&[]).is_overrun());
    }
}
