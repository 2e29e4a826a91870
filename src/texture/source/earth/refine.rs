//! Levels finer than the imagery: each texel is split into four, `child = parent + Haar detail`.
//!
//! Detail is the smooth prediction from the parent and its neighbours ([`super::predict`]), plus noise on the sphere.
//! The noise is as strong as the variation between texels of the finest imagery at that place. The same prediction is
//! computed for the noise, from the means of its 2 x 2 blocks, and subtracted (Cook and DeRose, "Wavelet noise", 2005,
//! section 3, with exact means). Subtracting only the means would leave edges around each block, which look like
//! woven cloth after six octaves.
//!
//! The four children are `P - a - b + c`, `P + a - b - c`, `P - a + b - c`, `P + a + b + c`, so their sum is
//! exactly 4 P. Scaling ensures `|a| + |b| + |c| <= min(P, 1 - P)`, so that no child leaves 0 ..= 1 and none
//! is clamped. The prediction alone may use 5/8 of that room; otherwise a dark texel beside snow would get
//! black children.
//!
//! Regions are rectangles in coordinates that may extend over a pole or the antimeridian. Every rounding is
//! symmetric, so a texel has the same value from either side.

use super::super::border::true_texel;
use super::base::{BASE_WIDTH_LOG2, CELLS_LOG2, EarthBase, LinearLight, STRENGTH_ONE, level_size};
use super::noise::{Column, columns, noise, row};
use super::predict::{Prediction, REACH, children};
use crate::picture::srgb::{self, LINEAR_ONE};

/// RMS of 4 (h - p) at the equator, where h is a Haar coefficient of the noise and p is its prediction. Measured; a
/// test checks it to 1 %.
const NOISE_RMS: i64 = 20_200;

/// Fraction bits of the interpolation weight between two strength cells.
const CELL_FRACTION_LOG2: u32 = 8;

/// A rectangle of one level in linear light; `left` and `top` may lie outside the level.
pub struct EarthRegion {
    pub left: i64,
    pub top: i64,
    pub width: usize,
    pub texels: Vec<LinearLight>,
}

impl EarthRegion {
    fn new(left: i64, top: i64, width: usize, height: usize) -> Self {
        Self { left, top, width, texels: vec![[0; 3]; width * height] }
    }

    /// The texels of one row from column `left` on.
    pub fn row(&self, left: i64, y: i64) -> &[LinearLight] {
        let (skip, row) = ((left - self.left) as usize, (y - self.top) as usize);
        &self.texels[row * self.width + skip..(row + 1) * self.width]
    }
}

/// A rectangle: left, top, width, height.
type Rectangle = (i64, i64, usize, usize);

/// The texels of the next coarser level whose children cover a rectangle.
fn parents_of((left, top, width, height): Rectangle) -> Rectangle {
    let span = |start: i64, length: usize| {
        let first = start.div_euclid(2);
        let end = (start + length as i64 + 1).div_euclid(2);
        (first, (end - first) as usize)
    };
    let ((left, width), (top, height)) = (span(left, width), span(top, height));
    (left, top, width, height)
}

/// A rectangle plus all texels that its prediction reads.
fn with_neighbours((left, top, width, height): Rectangle) -> Rectangle {
    let reach = REACH as i64;
    (left - reach, top - reach, width + 2 * REACH, height + 2 * REACH)
}

/// A rectangle of the level whose width is `2^width_log2` texels, and the region of the next coarser level from which
/// it was refined (`None` in the imagery). The rectangle may be one texel larger than requested on each side. The
/// coarser region also contains the texels that the prediction reads.
pub fn region(base: &EarthBase, width_log2: u32, rectangle: Rectangle) -> (EarthRegion, Option<EarthRegion>) {
    if width_log2 <= BASE_WIDTH_LOG2 {
        return (imagery(base, width_log2, rectangle), None);
    }
    let parents = parents_of(rectangle);
    let (coarser, _) = region(base, width_log2 - 1, with_neighbours(parents));
    (refine(base, width_log2, &coarser, parents), Some(coarser))
}

fn imagery(base: &EarthBase, width_log2: u32, (left, top, width, height): Rectangle) -> EarthRegion {
    let size = level_size(width_log2);
    let level = base.level(width_log2);
    let mut region = EarthRegion::new(left, top, width, height);
    for (index, texel) in region.texels.iter_mut().enumerate() {
        let [x, y] = true_texel(size, left + (index % width) as i64, top + (index / width) as i64);
        let stored = level[y as usize * size[0] as usize + x as usize];
        *texel = stored.map(|byte| srgb::table().linear(byte));
    }
    region
}

/// Position of a texel's centre between the cells of the strength map, along either axis: the cell before,
/// and the weight of the cell after in 1/256. The level is `2^width_log2` texels wide.
fn cell_weight(texel: i64, width_log2: u32) -> (i64, i64) {
    // (texel + 1/2) cells / texels - 1/2. The map is 2^10 cells wide, the level at least 2^12 texels.
    let shift = width_log2 + 1 - CELLS_LOG2;
    let centre = ((2 * texel + 1) << CELL_FRACTION_LOG2 >> shift) - (1 << (CELL_FRACTION_LOG2 - 1));
    (centre >> CELL_FRACTION_LOG2, centre & ((1 << CELL_FRACTION_LOG2) - 1))
}

/// All children of a rectangle of parents, in the level `2^width_log2` texels wide. `coarser` holds the
/// parents and their neighbours.
fn refine(base: &EarthBase, width_log2: u32, coarser: &EarthRegion, parents: Rectangle) -> EarthRegion {
    let (left, top, width, height) = parents;
    let mut finer = EarthRegion::new(2 * left, 2 * top, 2 * width, 2 * height);
    let blocks = NoiseBlocks::new(width_log2, with_neighbours(parents));
    let noise_smooth = Prediction::new(&blocks.sums, blocks.width);
    let light_smooth = Prediction::new(&coarser.texels, coarser.width);
    let strength_columns = StrengthColumns::new(width_log2 - 1, left, width);
    let (mut noise, mut light) = (vec![[[0; 1]; 3]; width], vec![[[0; 3]; 3]; width]);
    for (index, lines) in finer.texels.chunks_exact_mut(4 * width).enumerate() {
        let y = top + index as i64;
        noise_smooth.row(REACH, index + REACH, &mut noise);
        light_smooth.row((left - coarser.left) as usize, (y - coarser.top) as usize, &mut light);
        let strength = StrengthRow::new(base, width_log2 - 1, y, &strength_columns);
        let (north_line, south_line) = lines.split_at_mut(2 * width);
        let four_noises = &blocks.coefficients[(index + REACH) * blocks.width + REACH..][..width];
        for (x, parent) in coarser.row(left, y)[..width].iter().enumerate() {
            let coefficients = [0, 1, 2].map(|n| four_noises[x][n] - noise[x][n][0]);
            let strength = strength.at(x);
            for channel in 0..3 {
                let predicted = light[x].map(|coefficient| coefficient[channel]);
                let four = split(parent[channel], predicted, coefficients, strength);
                north_line[2 * x][channel] = four[0];
                north_line[2 * x + 1][channel] = four[1];
                south_line[2 * x][channel] = four[2];
                south_line[2 * x + 1][channel] = four[3];
            }
        }
    }
    finer
}

/// The noise of the children of a rectangle of parents.
struct NoiseBlocks {
    width: usize,
    /// Sum over the four children of each parent.
    sums: Vec<[i32; 1]>,
    /// Four times the Haar coefficients of the four children of each parent.
    coefficients: Vec<[i32; 3]>,
}

impl NoiseBlocks {
    /// `width_log2` is that of the children's level.
    fn new(width_log2: u32, (left, top, width, height): Rectangle) -> Self {
        let size = level_size(width_log2);
        // A row beyond a pole lies half a turn away, so it uses other columns.
        let table = |turn: i64| -> Vec<Column> {
            let true_column = move |x: i64| (x + turn).rem_euclid(i64::from(size[0])) as u32;
            columns(width_log2, (2 * left..2 * (left + width as i64)).map(true_column))
        };
        let parent_rows = 0..i64::from(size[1] / 2);
        let rows = top..top + height as i64;
        let straight = table(0);
        let crosses_a_pole = rows.start < parent_rows.start || rows.end > parent_rows.end;
        let turned = if crosses_a_pole { table(i64::from(size[0] / 2)) } else { Vec::new() };

        let (mut sums, mut coefficients) = (vec![[0]; width * height], vec![[0; 3]; width * height]);
        let lines = sums.chunks_exact_mut(width).zip(coefficients.chunks_exact_mut(width));
        for (y, (sums, coefficients)) in rows.zip(lines) {
            let columns = if parent_rows.contains(&y) { &straight } else { &turned };
            let [north, south] = [2 * y, 2 * y + 1].map(|y| row(width_log2, true_texel(size, 0, y)[1]));
            let blocks = sums.iter_mut().zip(coefficients).zip(columns.as_chunks().0);
            for (([sum], three), &[west, east]) in blocks {
                let [nw, ne] = [west, east].map(|column| noise(width_log2, north, column));
                let [sw, se] = [west, east].map(|column| noise(width_log2, south, column));
                *sum = nw + ne + sw + se;
                *three = [ne + se - nw - sw, sw + se - nw - ne, nw + se - ne - sw];
            }
        }
        Self { width, sums, coefficients }
    }
}

/// The children of a parent, from noise coefficients in units of 1/[`NOISE_RMS`] and a relative strength in units of
/// 1/[`STRENGTH_ONE`].
#[inline(always)]
fn split(parent: i32, predicted: [i32; 3], noise: [i32; 3], strength: i64) -> [i32; 4] {
    let room = parent.min(LINEAR_ONE - parent);
    let smooth = within(predicted, room / 8 * 5);
    // Products of 2^24 and 2^20, and of 2^24 and 2^18, fit i64. Division (not a shift) rounds towards zero,
    // so that a mirrored row gets mirrored detail.
    let amplitude = i64::from(parent) * strength / STRENGTH_ONE;
    let scaled = |n: usize| smooth[n] + (i64::from(noise[n]) * amplitude / NOISE_RMS) as i32;
    children(parent, within([scaled(0), scaled(1), scaled(2)], room))
}

/// Scales coefficients down by a common factor if their magnitudes add up to more than `room`.
#[inline(always)]
fn within(mut coefficients: [i32; 3], room: i32) -> [i32; 3] {
    let reach = coefficients[0].abs() + coefficients[1].abs() + coefficients[2].abs();
    if reach > room {
        // One division per texel: 2^24 * 2^30 in i64, rounded down, so that the sum stays within the room.
        let ratio = (i64::from(room) << 30) / i64::from(reach);
        for coefficient in &mut coefficients {
            let shrunk = ((i64::from(coefficient.abs()) * ratio) >> 30) as i32;
            *coefficient = shrunk * coefficient.signum();
        }
    }
    coefficients
}

/// Positions of a run of parents in the strength map: the two adjacent cells, and the weight of the second.
struct StrengthColumns(Vec<([usize; 2], i64)>);

impl StrengthColumns {
    fn new(width_log2: u32, left: i64, count: usize) -> Self {
        let cells = 1i64 << CELLS_LOG2;
        let column = |x: i64| {
            let (west, weight) = cell_weight(x, width_log2);
            ([west, west + 1].map(|cell| cell.rem_euclid(cells) as usize), weight)
        };
        Self((left..left + count as i64).map(column).collect())
    }
}

/// The strength map along one row of parents, blended from the two adjacent rows of cells.
struct StrengthRow<'a> {
    /// The cells of a row, and the column offset: half a turn beyond a pole.
    rows: [(&'a [u32], usize); 2],
    columns: &'a StrengthColumns,
    south: i64,
}

impl<'a> StrengthRow<'a> {
    fn new(base: &'a EarthBase, width_log2: u32, y: i64, columns: &'a StrengthColumns) -> Self {
        let size = level_size(CELLS_LOG2);
        let width = size[0] as usize;
        let (row, south) = cell_weight(y, width_log2);
        let line = |row: i64| {
            let [turn, row] = true_texel(size, 0, row).map(|at| at as usize);
            (&base.strength[row * width..][..width], turn)
        };
        Self { rows: [line(row), line(row + 1)], columns, south }
    }

    /// The relative strength, in units of 1/[`STRENGTH_ONE`].
    #[inline(always)]
    fn at(&self, x: usize) -> i64 {
        let (cells, east) = self.columns.0[x];
        let one = 1i64 << CELL_FRACTION_LOG2;
        let mut strength = 0;
        for ((row, turn), row_weight) in self.rows.iter().zip([one - self.south, self.south]) {
            for (cell, weight) in cells.iter().zip([one - east, east]) {
                strength += i64::from(row[(cell + turn) & ((1 << CELLS_LOG2) - 1)]) * row_weight * weight;
            }
        }
        strength >> (2 * CELL_FRACTION_LOG2)
    }
}

#[cfg(test)]
mod tests {
    use super::super::base::base;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn noise_at_the_equator_has_the_stated_root_mean_square() {
        let width_log2 = 16;
        let (width, height) = (1 << (width_log2 - 1), 256);
        let parents = (0, (1 << (width_log2 - 3)) - height as i64 / 2, width, height);
        let blocks = NoiseBlocks::new(width_log2, with_neighbours(parents));
        let smooth = Prediction::new(&blocks.sums, blocks.width);
        let (mut sum, mut predicted) = (0.0, vec![[[0; 1]; 3]; width]);
        for y in REACH..REACH + height {
            smooth.row(REACH, y, &mut predicted);
            for (noise, smooth) in blocks.coefficients[y * blocks.width + REACH..].iter().zip(&predicted) {
                sum += (0..3).map(|n| f64::from(noise[n] - smooth[n][0]).powi(2)).sum::<f64>();
            }
        }
        let found = f64::sqrt(sum / (3 * width * height) as f64);
        assert!((found / NOISE_RMS as f64 - 1.0).abs() < 0.01, "{found}");
    }

    proptest! {
        #[test]
        fn the_mean_of_four_children_is_their_parent_exactly_and_none_leaves_the_range(
            parent in 0..=LINEAR_ONE,
            predicted in prop::array::uniform3(-LINEAR_ONE / 2..=LINEAR_ONE / 2),
            noise in prop::array::uniform3(-200_000..=200_000i32),
            strength in 0..=STRENGTH_ONE,
        ) {
            let children = split(parent, predicted, noise, strength);
            prop_assert_eq!(children.iter().sum::<i32>(), 4 * parent);
            prop_assert!(children.iter().all(|child| (0..=LINEAR_ONE).contains(child)), "{:?}", children);
        }
    }

    #[test]
    fn children_of_a_region_have_their_parents_as_exact_means() {
        let base = base().unwrap();
        for (left, top) in [(-7, -5), (3001, 2040), (8190, 4090), (5000, 1203)] {
            let (children, parents) = region(base, 13, (left, top, 24, 20));
            let parents = parents.unwrap();
            let height = (parents.texels.len() / parents.width) as i64;
            for y in parents.top + 2..parents.top + height - 2 {
                for x in parents.left + 2..parents.left + parents.width as i64 - 2 {
                    let parent = parents.row(x, y)[0];
                    let [north, south] = [0, 1].map(|row| &children.row(2 * x, 2 * y + row)[..2]);
                    for channel in 0..3 {
                        let sum: i32 = north.iter().chain(south).map(|child| child[channel]).sum();
                        assert_eq!(sum, 4 * parent[channel], "{x} {y}");
                    }
                }
            }
        }
    }
}
