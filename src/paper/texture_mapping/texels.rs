//! A grey texture that repeats, with all its levels, as bytes of linear light.

/// Levels from the finest to a single texel, in row order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GreyMipmap {
    pub side: u32,
    pub levels: Vec<Vec<u8>>,
}

impl GreyMipmap {
    /// Each coarser texel is the mean of the texels of level 0 that it covers, rounded to the nearest byte. It is not a
    /// mean of rounded texels, so rounding errors do not accumulate.
    pub fn new(side: u32, finest: Vec<u8>) -> GreyMipmap {
        assert!(side.is_power_of_two() && finest.len() == (side * side) as usize, "{side} texels a side");
        let mut sums: Vec<u64> = finest.iter().map(|&byte| u64::from(byte)).collect();
        let mut levels = vec![finest];
        for level in 1..=side.ilog2() {
            let next = (side >> level) as usize;
            let sum = |n: usize| {
                let at = 2 * (n / next) * (2 * next) + 2 * (n % next);
                sums[at] + sums[at + 1] + sums[at + 2 * next] + sums[at + 2 * next + 1]
            };
            sums = (0..next * next).map(sum).collect();
            let texels = 1u64 << (2 * level);
            levels.push(sums.iter().map(|sum| ((2 * sum + texels) / (2 * texels)) as u8).collect());
        }
        GreyMipmap { side, levels }
    }

    /// The number of the coarsest level, which has one texel.
    pub fn coarsest(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    /// A byte of a texel; columns and rows wrap.
    pub fn byte(&self, level: u32, column: i64, row: i64) -> u8 {
        let side = i64::from(self.side >> level);
        self.levels[level as usize][(row.rem_euclid(side) * side + column.rem_euclid(side)) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texel_is_the_mean_of_its_texels_of_level_0() {
        let texels = GreyMipmap::new(4, (0..16).map(|n| if n == 5 { 255 } else { 0 }).collect());
        assert_eq!(texels.levels[1], [64, 0, 0, 0]);
        assert_eq!(texels.levels[2], [16]);
        assert_eq!(texels.byte(0, -3, 5), 255);
    }
}
