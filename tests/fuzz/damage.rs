//! Random damage to a file, the same in every run.

/// xorshift64*.
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % end
    }
}

/// Replacements for a number.
const WORDS: [&str; 12] = [
    "-1",
    "0",
    "3",
    "255",
    "4294967295",
    "4294967296",
    "1e308",
    "-0",
    "nan",
    "inf",
    "1.5",
    "99999999999999999999",
];

/// Applies one of six kinds of damage at a random offset.
pub fn damage(file: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(file.len());
    let end = (at + 1 + random.below(16)).min(file.len());
    match random.below(6) {
        0 => file[at] ^= 1 << random.below(8),
        1 => file[at] = random.below(256) as u8,
        2 => file.truncate(at + 1),
        3 => drop(file.drain(at..end)),
        4 => {
            let again = file[at..end].to_vec();
            file.splice(at..at, again);
        }
        _ => {
            // Replaces the number at or after the offset, or four bytes.
            let is_digit = |byte: &u8| byte.is_ascii_digit();
            let word = WORDS[random.below(WORDS.len())];
            match file[at..end].iter().position(is_digit) {
                Some(from) => {
                    let from = at + from;
                    let length = file[from..].iter().position(|byte| !is_digit(byte)).unwrap_or(1);
                    file.splice(from..from + length.max(1), word.bytes());
                }
                None => {
                    let value =
                        [0, 1, 0x7fff_ffff, u32::MAX, f32::NAN.to_bits(), 1e38f32.to_bits()][random.below(6)];
                    let end = (at + 4).min(file.len());
                    file.splice(at..end, value.to_le_bytes());
                }
            }
        }
    }
    if file.is_empty() {
        file.push(b'\n');
    }
}
