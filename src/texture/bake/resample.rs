//! Enlarges a picture to the next powers of two: separable Catmull-Rom in linear light, in integers.
//!
//! Texel x of n is at (x + 1/2)/n of the width. Columns wrap (the map closes at the antimeridian); rows
//! repeat at the edges. An axis that already fits has the weights 0, 1, 0, 0 and is unchanged.

use super::error::SourceError;
use super::input::RowReader;
use crate::picture::srgb::{self, LINEAR_ONE};
use rayon::prelude::*;
use std::collections::VecDeque;

/// Fraction bits of a weight.
const WEIGHT_LOG2: u32 = 14;
/// Texels per parallel piece of work.
const PIECE_TEXELS: usize = 4096;

/// The four taps of one target texel: the first source texel (may lie outside) and the weights, whose sum is
/// exactly 2^14.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Taps {
    first: i64,
    weights: [i32; 4],
}

impl Taps {
    /// For texel `index` of `target`, in a source of `source` texels.
    fn new(index: u32, source: u32, target: u32) -> Self {
        let [index, source, target] = [index, source, target].map(i64::from);
        // Position in source texels, (index + 1/2) source/target - 1/2, with denominator 2 target: exact.
        let numerator = (2 * index + 1) * source - target;
        let (before, rest) = (numerator.div_euclid(2 * target), numerator.rem_euclid(2 * target));
        // Fraction t in units of 2^-16, and its powers in units of 2^-48. `twice` holds the values of the Catmull-Rom
        // cubics times 2; the shift divides by 2 again.
        let t = (rest << 16) / (2 * target);
        let (t1, t2, t3) = (t << 32, (t * t) << 16, t * t * t);
        let one = 1i64 << 48;
        let twice = [-t3 + 2 * t2 - t1, 3 * t3 - 5 * t2 + 2 * one, -3 * t3 + 4 * t2 + t1, t3 - t2];
        let shift = 49 - WEIGHT_LOG2;
        let mut weights = twice.map(|weight| ((weight + (1 << (shift - 1))) >> shift) as i32);
        // Rounding may add or lose a unit; the larger middle weight absorbs it.
        let heavier = if weights[1] >= weights[2] { 1 } else { 2 };
        weights[heavier] += (1 << WEIGHT_LOG2) - weights.iter().sum::<i32>();
        Self { first: before - 1, weights }
    }
}

#[inline(always)]
fn weighted(values: [i32; 4], weights: [i32; 4]) -> i32 {
    let sum: i64 =
        std::iter::zip(values, weights).map(|(value, weight)| i64::from(value) * i64::from(weight)).sum();
    // At most 1.3 times 2^24 after both axes: overshoot is clamped only when the byte is made.
    ((sum + (1 << (WEIGHT_LOG2 - 1))) >> WEIGHT_LOG2) as i32
}

/// 0 ..= 255 to 0 ..= 2^24: alpha is linear already.
fn alpha_to_fixed(alpha: u8) -> i32 {
    ((i64::from(alpha) * i64::from(LINEAR_ONE) + 127) / 255) as i32
}

fn fixed_to_alpha(fixed: i32) -> u8 {
    ((i64::from(fixed.clamp(0, LINEAR_ONE)) * 255 + i64::from(LINEAR_ONE / 2)) >> 24) as u8
}

/// A source picture as level 0 of a pyramid, row by row from the north.
pub struct Enlarged {
    rows: Box<dyn RowReader>,
    source: [u32; 2],
    target: [u32; 2],
    columns: Vec<Taps>,
    /// The four rows that a target row needs, in linear light and already at the target's width.
    window: VecDeque<Vec<[i32; 4]>>,
    /// The source row of the window's first entry, and the next row of `rows`.
    window_start: u32,
    next_source: u32,
    next_target: u32,
    source_row: Vec<u8>,
}

impl Enlarged {
    pub fn new(rows: Box<dyn RowReader>, target: [u32; 2]) -> Self {
        let source = rows.size();
        assert!(source[0] <= target[0] && source[1] <= target[1], "{source:?} to {target:?}");
        let columns = if source == target {
            Vec::new()
        } else {
            (0..target[0]).map(|column| Taps::new(column, source[0], target[0])).collect()
        };
        Self {
            rows,
            source,
            target,
            columns,
            window: VecDeque::new(),
            window_start: 0,
            next_source: 0,
            next_target: 0,
            source_row: vec![0; source[0] as usize * 4],
        }
    }

    /// Peak memory besides the source: the window of four rows, one more row, and the taps.
    pub fn memory_bytes(source: [u32; 2], target: [u32; 2]) -> u64 {
        let row = u64::from(source[0]) * 4;
        if source == target { row } else { row + u64::from(target[0]) * (5 * 16 + 24) }
    }

    /// Fills `rgba` with whole rows from row `start`. Calls must go from north to south.
    pub fn read(&mut self, start: u32, rgba: &mut [u8]) -> Result<(), SourceError> {
        assert!(start >= self.next_target, "row {start} after {}", self.next_target);
        let row_bytes = self.target[0] as usize * 4;
        for (index, line) in rgba.chunks_exact_mut(row_bytes).enumerate() {
            let row = start + index as u32;
            if self.source == self.target {
                self.skip_to(row)?;
                self.rows.next_row(line)?;
                self.next_source += 1;
            } else {
                self.enlarge(row, line)?;
            }
            self.next_target = row + 1;
        }
        Ok(())
    }

    fn skip_to(&mut self, source_row: u32) -> Result<(), SourceError> {
        if source_row > self.next_source {
            self.rows.skip(source_row - self.next_source)?;
            self.next_source = source_row;
        }
        Ok(())
    }

    fn enlarge(&mut self, row: u32, line: &mut [u8]) -> Result<(), SourceError> {
        let taps = Taps::new(row, self.source[1], self.target[1]);
        let last = i64::from(self.source[1]) - 1;
        let needed = [0, 1, 2, 3].map(|tap| (taps.first + tap).clamp(0, last) as u32);
        self.fill_window(needed[0], needed[3])?;
        let four = needed.map(|row| self.window[(row - self.window_start) as usize].as_slice());
        let table = srgb::table();
        line.par_chunks_mut(PIECE_TEXELS * 4).enumerate().for_each(|(piece, line)| {
            for (index, texel) in line.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                let column = piece * PIECE_TEXELS + index;
                for channel in 0..4 {
                    let value = weighted(four.map(|row| row[column][channel]), taps.weights);
                    texel[channel] = if channel < 3 { table.encode(value) } else { fixed_to_alpha(value) };
                }
            }
        });
        Ok(())
    }

    /// Loads the source rows `first ..= last` into the window.
    fn fill_window(&mut self, first: u32, last: u32) -> Result<(), SourceError> {
        while self.window_start < first && self.window.pop_front().is_some() {
            self.window_start += 1;
        }
        if self.window.is_empty() {
            self.skip_to(first)?;
            self.window_start = first;
        }
        while self.next_source <= last {
            self.rows.next_row(&mut self.source_row)?;
            self.next_source += 1;
            let row = self.widen();
            self.window.push_back(row);
        }
        Ok(())
    }

    /// The current source row in linear light, at the target's width.
    fn widen(&self) -> Vec<[i32; 4]> {
        let table = srgb::table();
        let source = self.source_row.as_chunks::<4>().0;
        let width = i64::from(self.source[0]);
        let texel = |at: i64| {
            let [r, g, b, alpha] = source[at.rem_euclid(width) as usize];
            [table.linear(r), table.linear(g), table.linear(b), alpha_to_fixed(alpha)]
        };
        let target = |taps: &Taps| {
            let four = [0, 1, 2, 3].map(|tap| texel(taps.first + tap));
            [0, 1, 2, 3].map(|channel| weighted(four.map(|texel| texel[channel]), taps.weights))
        };
        self.columns.par_iter().with_min_len(PIECE_TEXELS).map(target).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_and_lie_within_a_unit_and_a_half_of_the_cubic() {
        for (source, target) in [(5, 8), (300, 512), (5400, 8192), (1_000_000, 1 << 20)] {
            for index in (0..target).step_by(1 + target as usize / 997) {
                let taps = Taps::new(index, source, target);
                assert_eq!(taps.weights.iter().sum::<i32>(), 1 << 14);
                let place = (f64::from(index) + 0.5) * f64::from(source) / f64::from(target) - 0.5;
                assert_eq!(taps.first, place.floor() as i64 - 1, "{index} of {target}");
                for (tap, &weight) in taps.weights.iter().enumerate() {
                    let x = (place - (taps.first + tap as i64) as f64).abs();
                    let exact = if x < 1.0 {
                        1.5 * x.powi(3) - 2.5 * x.powi(2) + 1.0
                    } else {
                        -0.5 * x.powi(3) + 2.5 * x.powi(2) - 4.0 * x + 2.0
                    };
                    // The corrected weight takes up the roundings of the three others: 1.5 units. The fraction is
                    // truncated to 2^-16, and the cubics' slopes are at most 1.39: 0.35 units.
                    let difference = f64::from(weight) - exact * 16384.0;
                    assert!(difference.abs() < 1.9, "{index} tap {tap}: {weight}, {}", exact * 16384.0);
                }
            }
        }
    }

    #[test]
    fn a_size_that_fits_has_the_weights_of_the_identity() {
        for index in [0, 1, 511] {
            let taps = Taps::new(index, 512, 512);
            assert_eq!(taps, Taps { first: i64::from(index) - 1, weights: [0, 1 << 14, 0, 0] });
        }
    }

    #[test]
    fn alpha_survives_the_round_trip() {
        for alpha in 0..=255 {
            assert_eq!(fixed_to_alpha(alpha_to_fixed(alpha)), alpha);
        }
    }

    /// A source whose rows come from a closure.
    struct Drawn([u32; 2], fn(u32, u32) -> [u8; 4], u32);

    impl RowReader for Drawn {
        fn size(&self) -> [u32; 2] {
            self.0
        }
        fn memory_bytes(&self) -> u64 {
            0
        }
        fn next_row(&mut self, rgba: &mut [u8]) -> Result<(), SourceError> {
            for (x, texel) in rgba.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                *texel = self.1(x as u32, self.2);
            }
            self.2 += 1;
            Ok(())
        }
        fn skip(&mut self, rows: u32) -> Result<(), SourceError> {
            self.2 += rows;
            Ok(())
        }
    }

    fn enlarged(size: [u32; 2], draw: fn(u32, u32) -> [u8; 4], target: [u32; 2]) -> Vec<u8> {
        let mut enlarged = Enlarged::new(Box::new(Drawn(size, draw, 0)), target);
        let mut rgba = vec![0; target[0] as usize * target[1] as usize * 4];
        enlarged.read(0, &mut rgba).unwrap();
        rgba
    }

    fn dotted(x: u32, y: u32) -> [u8; 4] {
        [(x * 37 + y * 11) as u8, (x * y) as u8, ((x ^ y) * 3) as u8, 255 - x as u8]
    }

    /// The formula in f64, one texel at a time.
    fn plain(size: [u32; 2], draw: fn(u32, u32) -> [u8; 4], target: [u32; 2]) -> Vec<u8> {
        let cubic = |x: f64| match x.abs() {
            x if x < 1.0 => 1.5 * x.powi(3) - 2.5 * x.powi(2) + 1.0,
            x if x < 2.0 => -0.5 * x.powi(3) + 2.5 * x.powi(2) - 4.0 * x + 2.0,
            _ => 0.0,
        };
        let mut bytes = Vec::new();
        for y in 0..target[1] {
            for x in 0..target[0] {
                let place = |at: u32, axis: usize| {
                    (f64::from(at) + 0.5) * f64::from(size[axis]) / f64::from(target[axis]) - 0.5
                };
                let (u, v) = (place(x, 0), place(y, 1));
                let mut sum = [0.0; 4];
                for j in v.floor() as i64 - 1..=v.floor() as i64 + 2 {
                    for i in u.floor() as i64 - 1..=u.floor() as i64 + 2 {
                        let column = i.rem_euclid(i64::from(size[0])) as u32;
                        let row = j.clamp(0, i64::from(size[1]) - 1) as u32;
                        let texel = draw(column, row);
                        let weight = cubic(u - i as f64) * cubic(v - j as f64);
                        for channel in 0..3 {
                            sum[channel] += weight * srgb::to_linear_f64(texel[channel]);
                        }
                        sum[3] += weight * f64::from(texel[3]);
                    }
                }
                bytes.extend([0, 1, 2].map(|channel| srgb::from_linear_f64(sum[channel])));
                bytes.push(sum[3].round().clamp(0.0, 255.0) as u8);
            }
        }
        bytes
    }

    fn worst(one: &[u8], other: &[u8]) -> u8 {
        assert_eq!(one.len(), other.len());
        std::iter::zip(one, other).map(|(a, b)| a.abs_diff(*b)).max().unwrap()
    }

    #[test]
    fn enlarging_equals_the_formula_within_one_code_even_across_the_edges() {
        // One code: weights of 2^-14 change dark texels beside bright ones by up to 2^-13 of light, which is
        // 0.4 codes near black.
        for size in [[13, 11], [16, 11], [13, 16], [9, 9]] {
            let (found, expected) = (enlarged(size, dotted, [16, 16]), plain(size, dotted, [16, 16]));
            assert!(worst(&found, &expected) <= 1, "{size:?}: {}", worst(&found, &expected));
        }
        // Neighbour test: the picture shifted by one column must fail.
        let moved = plain([13, 11], |x, y| dotted((x + 1) % 13, y), [16, 16]);
        assert!(worst(&enlarged([13, 11], dotted, [16, 16]), &moved) > 1);
    }

    #[test]
    fn reading_from_the_middle_gives_the_same_rows() {
        let whole = enlarged([13, 300], dotted, [16, 512]);
        for start in [1, 7, 255, 509] {
            let mut enlarged = Enlarged::new(Box::new(Drawn([13, 300], dotted, 0)), [16, 512]);
            let mut part = vec![0; 3 * 64];
            enlarged.read(start, &mut part).unwrap();
            assert_eq!(part, whole[start as usize * 64..][..3 * 64], "row {start}");
        }
    }
}
