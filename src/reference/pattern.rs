//! Test patterns: square grey textures that repeat in both directions, one byte of linear light per texel.

use crate::math::splitmix::SplitMix64;
use std::f64::consts::TAU;

/// The content of a test texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    Constant(u8),
    /// Squares of this many texels, black and white.
    Checker(u32),
    /// Concentric rings, up to half a cycle per texel at the middle of each edge.
    ZonePlate,
    /// 32 white and 32 black sectors.
    SiemensStar,
    /// Cycles across the whole texture along a row, and along a column.
    Sinusoid(f64, f64),
    WhiteNoise,
    /// Equal energy in each octave: amplitude spectrum 1/f.
    PinkNoise,
    /// One white texel in each square of this side, on black.
    Impulses(u32),
    /// Lines of black letters on white, with strokes of 2 texels.
    Text,
}

impl Pattern {
    pub fn name(self) -> String {
        match self {
            Pattern::Constant(byte) => format!("constant-{byte}"),
            Pattern::Checker(texels) => format!("checker-{texels}"),
            Pattern::ZonePlate => "zone-plate".into(),
            Pattern::SiemensStar => "siemens-star".into(),
            Pattern::Sinusoid(along, down) => format!("sinusoid-{along}-{down}"),
            Pattern::WhiteNoise => "white-noise".into(),
            Pattern::PinkNoise => "pink-noise".into(),
            Pattern::Impulses(texels) => format!("impulses-{texels}"),
            Pattern::Text => "text".into(),
        }
    }

    /// Level 0: `side` x `side` texels, row by row; `side` is a power of two.
    pub fn texels(self, side: u32) -> Vec<u8> {
        assert!(side.is_power_of_two(), "{side} texels a side");
        if self == Pattern::PinkNoise {
            return pink_noise(side);
        }
        let texel = |x: u32, y: u32| self.texel(side, x, y);
        (0..side).flat_map(|y| (0..side).map(move |x| texel(x, y))).collect()
    }

    fn texel(self, side: u32, x: u32, y: u32) -> u8 {
        let black_or_white = |white: bool| if white { 255 } else { 0 };
        let from_middle = [x, y].map(|n| f64::from(n) + 0.5 - f64::from(side) / 2.0);
        let wave = |cycles: f64| ((0.5 + 0.5 * (TAU * cycles).cos()) * 255.0).round() as u8;
        match self {
            Pattern::Constant(byte) => byte,
            Pattern::Checker(texels) => black_or_white((x / texels + y / texels) % 2 == 1),
            Pattern::ZonePlate => {
                let [a, b] = from_middle;
                wave((a * a + b * b) / (2.0 * f64::from(side)))
            }
            Pattern::SiemensStar => {
                let [a, b] = from_middle;
                black_or_white((32.0 * b.atan2(a)).sin() > 0.0)
            }
            Pattern::Sinusoid(along, down) => {
                wave((along * (f64::from(x) + 0.5) + down * (f64::from(y) + 0.5)) / f64::from(side))
            }
            Pattern::WhiteNoise => noise(0, u64::from(y) * u64::from(side) + u64::from(x)) as u8,
            Pattern::PinkNoise => unreachable!("pink noise is generated as a whole"),
            Pattern::Impulses(texels) => black_or_white([x, y].iter().all(|n| n.is_multiple_of(texels))),
            Pattern::Text => black_or_white(!inked(x, y)),
        }
    }
}

/// The line of [`Pattern::Text`]; its letters are those of [`GLYPHS`]. 16 letters of 16 texels fill 256 texels.
const LINE: &[u8; 16] = b"TEXTURE MAPPING ";

/// Each letter in 7 rows of 5 dots, the leftmost dot in the highest bit.
const GLYPHS: [(u8, [u8; 7]); 11] = [
    (b'A', [0b01110, 0b10001, 0b10001, 0b11111, 0b10001, 0b10001, 0b10001]),
    (b'E', [0b11111, 0b10000, 0b10000, 0b11110, 0b10000, 0b10000, 0b11111]),
    (b'G', [0b01110, 0b10001, 0b10000, 0b10111, 0b10001, 0b10001, 0b01110]),
    (b'I', [0b01110, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110]),
    (b'M', [0b10001, 0b11011, 0b10101, 0b10101, 0b10001, 0b10001, 0b10001]),
    (b'N', [0b10001, 0b11001, 0b10101, 0b10011, 0b10001, 0b10001, 0b10001]),
    (b'P', [0b11110, 0b10001, 0b10001, 0b11110, 0b10000, 0b10000, 0b10000]),
    (b'R', [0b11110, 0b10001, 0b10001, 0b11110, 0b10100, 0b10010, 0b10001]),
    (b'T', [0b11111, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100]),
    (b'U', [0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b01110]),
    (b'X', [0b10001, 0b10001, 0b01010, 0b00100, 0b01010, 0b10001, 0b10001]),
];

/// True if the texel belongs to a letter. A letter has a field of 8 x 8 dots; a dot is 2 x 2 texels. Each line starts
/// five letters later than the line above it, so that equal letters do not form columns.
fn inked(x: u32, y: u32) -> bool {
    let (column, row) = (x / 2, y / 2);
    let letter = LINE[((column / 8 + row / 8 * 5) % 16) as usize];
    let glyph = GLYPHS.iter().find(|(of, _)| *of == letter);
    let dots = glyph.and_then(|(_, rows)| rows.get((row % 8) as usize)).copied().unwrap_or_default();
    // Dots 5, 6 and 7 of a field are the gap between letters.
    column % 8 < 5 && dots >> (4 - column % 8) & 1 == 1
}

/// A pseudo-random number of 0 ..= 255, the same on every machine.
fn noise(seed: u64, n: u64) -> u64 {
    SplitMix64::nth(seed, n) >> 56
}

/// Sum of octaves of white noise, stretched to 0 ..= 255. Each octave is interpolated from cells twice as large as the
/// previous octave's.
fn pink_noise(side: u32) -> Vec<u8> {
    let octaves = side.ilog2();
    let value = |x: u32, y: u32| -> f64 {
        let octave = |log2: u32| {
            let (cells, cell) = (u64::from(side >> log2), f64::from(1u32 << log2));
            let [(left, right), (top, down)] = [x, y].map(|n| {
                let at = (f64::from(n) + 0.5) / cell - 0.5;
                (at.floor().rem_euclid(cells as f64) as u64, at - at.floor())
            });
            let corner = |i: u64, j: u64| {
                let (column, row) = ((left + i) % cells, (top + j) % cells);
                noise(u64::from(log2) + 1, row * cells + column) as f64
            };
            let mix = |a: f64, b: f64, part: f64| a + (b - a) * part;
            mix(mix(corner(0, 0), corner(1, 0), right), mix(corner(0, 1), corner(1, 1), right), down)
        };
        (0..octaves).map(octave).sum()
    };
    let values: Vec<f64> = (0..side).flat_map(|y| (0..side).map(move |x| value(x, y))).collect();
    let (min, max) = values.iter().fold((f64::MAX, f64::MIN), |(low, high), &v| (low.min(v), high.max(v)));
    values.iter().map(|value| ((value - min) / (max - min) * 255.0).round() as u8).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_tile_and_match_their_names() {
        let checker = Pattern::Checker(2).texels(8);
        assert_eq!(checker[..8], [0, 0, 255, 255, 0, 0, 255, 255]);
        assert_eq!(checker[2 * 8..3 * 8], [255, 255, 0, 0, 255, 255, 0, 0]);
        let impulses = Pattern::Impulses(4).texels(8);
        assert_eq!(impulses.iter().filter(|&&texel| texel == 255).count(), 4);
        // Near the edge there is almost half a cycle per texel: neighbours differ by almost the full range, and texels
        // two apart hardly differ.
        let zone = Pattern::ZonePlate.texels(512);
        let row = &zone[256 * 512..257 * 512];
        assert!(row[16].abs_diff(row[17]) > 220 && row[16].abs_diff(row[18]) < 60, "{:?}", &row[..20]);
        let star = Pattern::SiemensStar.texels(64);
        let whites = star.iter().filter(|&&texel| texel == 255).count();
        assert!((whites as f64 / star.len() as f64 - 0.5).abs() < 0.02, "{whites}");
    }

    #[test]
    fn text_is_lines_of_letters() {
        let text = Pattern::Text.texels(256);
        let dots = |letter: usize, line: usize| -> Vec<String> {
            let dot =
                |row: usize, column: usize| text[(16 * line + 2 * row) * 256 + 16 * letter + 2 * column] == 0;
            let row = |row| (0..8).map(|column| if dot(row, column) { '#' } else { '.' }).collect();
            (0..8).map(row).collect()
        };
        let r =
            ["####....", "#...#...", "#...#...", "####....", "#.#.....", "#..#....", "#...#...", "........"];
        assert_eq!(dots(5, 0), r);
        // The next line starts five letters later, with the R.
        assert_eq!(dots(0, 1), r);
        assert_eq!(dots(7, 0), ["........"; 8], "the space between the words");
        assert!(LINE.iter().all(|letter| *letter == b' ' || GLYPHS.iter().any(|(of, _)| of == letter)));
    }

    #[test]
    fn pink_noise_has_equal_energy_in_each_octave() {
        let side = 256;
        let texels = Pattern::PinkNoise.texels(side);
        let at = |x: u32, y: u32| f64::from(texels[(y % side * side + x % side) as usize]);
        // Differences of block means respond to one octave each.
        let energy = |block: u32| {
            let mean = |i: u32, j: u32| {
                let of = (0..block).flat_map(|y| (0..block).map(move |x| (x, y)));
                of.map(|(x, y)| at(i * block + x, j * block + y)).sum::<f64>() / f64::from(block * block)
            };
            let blocks = side / block;
            let of = (0..blocks).flat_map(|j| (0..blocks).map(move |i| (i, j)));
            let squares = of.map(|(i, j)| (mean(i, j) - mean(i + 1, j)).powi(2));
            squares.sum::<f64>() / f64::from(blocks * blocks)
        };
        let octaves = [2, 4, 8, 16].map(energy);
        for pair in octaves.windows(2) {
            assert!((0.5..2.0).contains(&(pair[1] / pair[0])), "{octaves:?}");
        }
    }
}
