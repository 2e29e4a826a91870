//! The ruler: every texel is a hash of its own level and position, so that a fetch proves which texel it
//! returned.

use super::border::Square;
use super::{TileError, TileSource};
use crate::math::mix::mix;
use crate::math::pyramid::{Pyramid, TileId};

/// The texel of column `x`, row `y` of level `level`: RGBA8, red in the low byte.
///
/// `mix(mix(mix(level + 0x9E3779B9) ^ x) ^ y)`, all in u32: the same three lines in GLSL. For one level and
/// column, all rows differ (each step is a bijection).
pub const fn ruler_hash(level: u32, x: u32, y: u32) -> u32 {
    mix(mix(mix(level.wrapping_add(0x9E37_79B9)) ^ x) ^ y)
}

/// A pyramid of any size whose texels are [`ruler_hash`]; the levels are not averages of each other. Shaders must
/// fetch the texels as UNORM without filtering.
#[derive(Clone, Debug)]
pub struct Ruler {
    pyramid: Pyramid,
}

impl Ruler {
    pub fn new(pyramid: Pyramid) -> Self {
        Self { pyramid }
    }
}

impl TileSource for Ruler {
    fn describe(&self) -> String {
        format!("ruler, 2^{} x 2^{}", self.pyramid.width_log2(), self.pyramid.height_log2())
    }

    fn pyramid(&self) -> Pyramid {
        self.pyramid
    }

    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        let [fine, coarse] = Square::both(&self.pyramid, tile, bytes);
        for (level, square) in [(tile.level, fine), (tile.level + 1, coarse)] {
            let texel = |[x, y]: [u32; 2]| ruler_hash(level, x, y).to_le_bytes();
            square.fill(self.pyramid.level_size(level), texel);
        }
        Ok(())
    }

    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        assert!(level >= self.pyramid.first_resident_level(), "level {level} of {:?}", self.pyramid);
        let [width, height] = self.pyramid.level_size(level);
        let row = |y: u32| (0..width).flat_map(move |x| ruler_hash(level, x, y).to_le_bytes());
        Ok((0..height).flat_map(row).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn one_flipped_bit_of_level_x_or_y_flips_each_bit_of_the_hash_half_of_the_time() {
        // 4096 pairs: a fair count has a standard deviation of 32, so 40 to 60 % allows 12 standard deviations.
        let widths = [5, 20, 20];
        for (argument, bits) in widths.into_iter().enumerate() {
            for input_bit in 0..bits {
                let mut turned = [0u32; 32];
                for sample in 0..4096u32 {
                    let mut at = [mix(sample) % 21, mix(sample ^ 0x5555) >> 12, mix(sample ^ 0xAAAA) >> 12];
                    let before = ruler_hash(at[0], at[1], at[2]);
                    at[argument] ^= 1 << input_bit;
                    let difference = before ^ ruler_hash(at[0], at[1], at[2]);
                    for (output_bit, count) in turned.iter_mut().enumerate() {
                        *count += difference >> output_bit & 1;
                    }
                }
                for (output_bit, count) in turned.into_iter().enumerate() {
                    assert!(
                        (1638..=2458).contains(&count),
                        "argument {argument}, bit {input_bit} -> {output_bit}: {count} of 4096"
                    );
                }
            }
        }
    }

    #[test]
    fn neighbours_levels_and_swapped_coordinates_differ() {
        // 3 x 128 x 128 hashes of 32 bits: a random function would give 0.28 equal pairs, and this hash gives none.
        let mut seen = HashSet::new();
        for level in 0..3 {
            for y in 0..128 {
                for x in 0..128 {
                    assert!(seen.insert(ruler_hash(level, x, y)), "{level} {x} {y}");
                }
            }
        }
    }

    #[test]
    fn the_hash_is_pinned_for_shaders_to_compare_with() {
        assert_eq!(ruler_hash(0, 0, 0), 0x944f_b554);
        assert_eq!(ruler_hash(17, 1_048_575, 524_287), 0x36ba_b5e6);
    }

    #[test]
    fn a_tile_holds_both_levels_with_their_true_neighbours() {
        let pyramid = Pyramid::new(7, 6, 4, 2, None).unwrap();
        let ruler = Ruler::new(pyramid);
        let mut bytes = vec![0; pyramid.tile_bytes_rgba8()];
        // The north-west tile: its corner crosses both the pole and the antimeridian.
        ruler.read_tile(TileId { level: 1, row: 0, column: 0 }, &mut bytes).unwrap();
        let texel = |index: usize| u32::from_le_bytes(bytes[index * 4..index * 4 + 4].try_into().unwrap());
        // Level 1 is 64 x 32: (-2, -2) is row 1, half a turn from column 62.
        assert_eq!(texel(0), ruler_hash(1, 30, 1));
        assert_eq!(texel(2 * 20 + 2), ruler_hash(1, 0, 0));
        assert_eq!(texel(2 * 20 + 1), ruler_hash(1, 63, 0));
        assert_eq!(texel(20 * 20 - 1), ruler_hash(1, 17, 17));
        // Level 2 is 32 x 16, one texel of border.
        assert_eq!(texel(20 * 20), ruler_hash(2, 15, 0));
        assert_eq!(texel(20 * 20 + 11), ruler_hash(2, 0, 0));
        assert_eq!(texel(20 * 20 + 99), ruler_hash(2, 8, 8));
    }
}
