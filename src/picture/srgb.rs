//! sRGB bytes <-> linear light, identical on every machine: tables computed with `libm` only (pure IEEE f64
//! arithmetic, not the system's maths library), then integers.
//!
//! Curve: IEC 61966-2-1, `x/12.92` up to 0.04045, else `((x + 0.055)/1.055)^2.4`.
//! Fixed point: [`LINEAR_ONE`] = 2^24 is 1.0. The darkest code step, 1/(255*12.92), is 5092 units. A rounding
//! of one unit thus moves no byte by more than 1/5000 of a step, and four values add up within i32.

use std::sync::LazyLock;

/// 1.0 in fixed-point linear light.
pub const LINEAR_ONE: i32 = 1 << 24;

/// Bucket width of the first guess when linear light is encoded to a byte: 2^12 units, less than the smallest code step
/// (5092), so a bucket holds at most one threshold.
const BUCKET_LOG2: u32 = 12;

fn curve(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// Linear light, 0.0 ..= 1.0, of an sRGB byte.
pub fn to_linear_f64(byte: u8) -> f64 {
    curve(f64::from(byte) / 255.0)
}

/// The byte whose encoded value is nearest to that of `linear`. A value exactly between two codes gives the
/// larger one. Below 0 gives 0, above 1 gives 255, NaN gives 0.
pub fn from_linear_f64(linear: f64) -> u8 {
    let thresholds = &table().thresholds_f64;
    u8::try_from(thresholds.partition_point(|&threshold| threshold <= linear)).unwrap_or(255)
}

/// Both directions in fixed point. Get it once with [`table`], outside of loops.
pub struct SrgbTable {
    linear: [i32; 256],
    /// The code at the lower end of each bucket of 2^12 units.
    bucket_code: [u8; ((LINEAR_ONE >> BUCKET_LOG2) + 1) as usize],
    /// Entry c: smallest fixed-point value of code c + 1.
    next_threshold: [i32; 256],
    /// The same thresholds as unrounded fractions of 1.
    thresholds_f64: [f64; 255],
}

static TABLE: LazyLock<SrgbTable> = LazyLock::new(SrgbTable::build);

/// The table, built on first use.
pub fn table() -> &'static SrgbTable {
    &TABLE
}

impl SrgbTable {
    fn build() -> Self {
        let one = f64::from(LINEAR_ONE);
        let linear = std::array::from_fn(|code| libm::round(curve(code as f64 / 255.0) * one) as i32);
        let thresholds_f64: [f64; 255] = std::array::from_fn(|code| curve((code as f64 + 0.5) / 255.0));
        let next_threshold = std::array::from_fn(|code| match thresholds_f64.get(code) {
            Some(threshold) => libm::ceil(threshold * one) as i32,
            None => i32::MAX,
        });
        let bucket_code = std::array::from_fn(|bucket| {
            let value = (bucket as i32) << BUCKET_LOG2;
            next_threshold.iter().filter(|&&threshold| threshold <= value).count() as u8
        });
        Self { linear, bucket_code, next_threshold, thresholds_f64 }
    }

    /// Fixed-point linear light, 0 ..= [`LINEAR_ONE`], of a byte.
    #[inline]
    pub fn linear(&self, byte: u8) -> i32 {
        self.linear[usize::from(byte)]
    }

    /// The byte whose encoded value is nearest. The result is exact, because the thresholds lie at code + 1/2. Values
    /// outside `0 ..= LINEAR_ONE` clamp.
    #[inline]
    pub fn encode(&self, linear: i32) -> u8 {
        let clamped = linear.clamp(0, LINEAR_ONE);
        let code = self.bucket_code[(clamped >> BUCKET_LOG2) as usize];
        code + u8::from(clamped >= self.next_threshold[usize::from(code)])
    }

    /// The mean of four bytes in linear light, rounded half up to a unit of 2^-24, then encoded.
    #[inline]
    pub fn mean_of_four(&self, bytes: [u8; 4]) -> u8 {
        let sum: i32 = bytes.iter().map(|&byte| self.linear(byte)).sum();
        self.encode((sum + 2) >> 2)
    }

    /// The mean of four RGB or RGBA texels: colour as [`Self::mean_of_four`], alpha (which is linear already) as
    /// the mean rounded half up. Colour is not weighted by alpha.
    #[inline]
    pub fn mean_of_four_texels<const N: usize>(&self, texels: [[u8; N]; 4]) -> [u8; N] {
        std::array::from_fn(|channel| {
            let bytes = texels.map(|texel| texel[channel]);
            if channel < 3 {
                return self.mean_of_four(bytes);
            }
            let sum: u16 = bytes.iter().map(|&byte| u16::from(byte)).sum();
            ((sum + 2) >> 2) as u8
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_round_trip() {
        for byte in 0..=255 {
            assert_eq!(table().encode(table().linear(byte)), byte);
            assert_eq!(from_linear_f64(to_linear_f64(byte)), byte);
        }
    }

    #[test]
    fn encode_switches_exactly_at_the_threshold_between_two_codes() {
        for code in 0..255u8 {
            let threshold = table().next_threshold[usize::from(code)];
            assert_eq!(table().encode(threshold - 1), code);
            assert_eq!(table().encode(threshold), code + 1);
            // The threshold is the middle of both codes in encoded value, to one unit of 2^-24.
            let middle = curve((f64::from(code) + 0.5) / 255.0) * f64::from(LINEAR_ONE);
            assert!((0.0..1.0).contains(&(f64::from(threshold) - middle)), "{code}: {threshold} {middle}");
        }
    }

    #[test]
    fn encode_equals_a_plain_search_everywhere_on_a_fine_grid() {
        let plain = |value: i32| (0..255).filter(|&code| table().next_threshold[code] <= value).count() as u8;
        for value in (0..=LINEAR_ONE).step_by(997).chain([LINEAR_ONE]) {
            assert_eq!(table().encode(value), plain(value), "{value}");
        }
        assert_eq!((table().encode(-1), table().encode(i32::MIN)), (0, 0));
        assert_eq!((table().encode(LINEAR_ONE + 1), table().encode(i32::MAX)), (255, 255));
    }

    #[test]
    fn published_values_of_the_curve_hold() {
        // Half intensity encodes to 187.52, which rounds to 188. 18 % grey encodes to 117.6, which rounds to
        // 118.
        assert_eq!(from_linear_f64(0.5), 188);
        assert_eq!(from_linear_f64(0.18), 118);
        assert!((to_linear_f64(10) - 10.0 / 255.0 / 12.92).abs() < 1e-18);
        assert_eq!((to_linear_f64(0), to_linear_f64(255)), (0.0, 1.0));
        assert_eq!((from_linear_f64(f64::NAN), from_linear_f64(-1.0), from_linear_f64(9.0)), (0, 0, 255));
    }

    #[test]
    fn the_mean_is_taken_in_linear_light_not_of_the_bytes() {
        assert_eq!(table().mean_of_four([0, 0, 255, 255]), 188);
        assert_eq!(table().mean_of_four([7; 4]), 7);
        let mean =
            table().mean_of_four_texels([[0, 7, 255, 0], [0, 7, 255, 0], [255, 7, 0, 1], [255, 7, 0, 1]]);
        assert_eq!(mean, [188, 7, 188, 1]);
    }

    #[test]
    fn the_tables_are_the_same_on_every_machine() {
        let mut bytes = Vec::new();
        bytes.extend(table().linear.iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend(table().next_threshold.iter().flat_map(|value| value.to_le_bytes()));
        assert_eq!(xxhash_rust::xxh3::xxh3_64(&bytes), 16_624_630_584_271_484_276);
    }
}
