//! Finer than the imagery: each texel becomes four, `child = parent + Haar detail`.
//!
//! Detail is what smooth light predicts from the parent's neighbours, plus noise on the sphere as strong as
//! the finest real band there. The four children are `P + a + b + c`, `P - a + b - c`, `P + a - b - c`,
//! `P - a - b + c`, so their sum is 4 P exactly; and `|a| + |b| + |c| <= min(P, 1 - P)` by scaling, so that
//! none leaves 0 ..= 1 and none is clamped.
//!
//! Regions are rectangles in coordinates that may run over a pole or the antimeridian; every rounding is
//! symmetric, so a texel has the same value from either side.

use super::super::border::true_texel;
use super::base::{BASE_WIDTH_LOG2, Base, CELLS_LOG2, Linear, STRENGTH_ONE, level_size, predicted};
use super::noise::{Column, columns, noise, row};
use crate::picture::srgb::{self, LINEAR_ONE};

/// Root mean square, at the equator, of a sum of four noise values with the signs of a Haar coefficient.
/// Measured (a test holds it within 1 %).
const NOISE_RMS: i64 = 18_470;

/// Fraction bits of a strength between two cells.
const CELL_FRACTION_LOG2: u32 = 8;

/// A rectangle of one level in linear light; `left` and `top` may lie outside the level.
pub struct Region {
    pub left: i64,
    pub top: i64,
    pub width: usize,
    pub texels: Vec<Linear>,
}

impl Region {
    fn new(left: i64, top: i64, width: usize, height: usize) -> Self {
        Self { left, top, width, texels: vec![[0; 3]; width * height] }
    }

    /// The texels of one row from column `left` on.
    pub fn row(&self, left: i64, y: i64) -> &[Linear] {
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

/// A rectangle of the level `2^width_log2` texels wide, and the region of the next coarser level that it
/// came from (none in the imagery). Both may be larger than asked, by a texel on each side.
pub fn region(base: &Base, width_log2: u32, rectangle: Rectangle) -> (Region, Option<Region>) {
    if width_log2 <= BASE_WIDTH_LOG2 {
        return (imagery(base, width_log2, rectangle), None);
    }
    let parents = parents_of(rectangle);
    let (left, top, width, height) = parents;
    // The prediction looks at the eight neighbours of each parent.
    let with_neighbours = (left - 1, top - 1, width + 2, height + 2);
    let (coarser, _) = region(base, width_log2 - 1, with_neighbours);
    (refine(base, width_log2, &coarser, parents), Some(coarser))
}

fn imagery(base: &Base, width_log2: u32, (left, top, width, height): Rectangle) -> Region {
    let size = level_size(width_log2);
    let level = base.level(width_log2);
    let mut region = Region::new(left, top, width, height);
    for (index, texel) in region.texels.iter_mut().enumerate() {
        let [x, y] = true_texel(size, left + (index % width) as i64, top + (index / width) as i64);
        let stored = level[y as usize * size[0] as usize + x as usize];
        *texel = stored.map(|byte| srgb::table().linear(byte));
    }
    region
}

/// Between which cells of the strength map the centre of a texel of the level `2^width_log2` texels wide lies,
/// on either axis: the cell before, and the weight of the one after, in 1/256.
fn cell_weight(texel: i64, width_log2: u32) -> (i64, i64) {
    // (texel + 1/2) cells / texels - 1/2, the map being 2^10 cells wide and the level at least 2^12 texels.
    let shift = width_log2 + 1 - CELLS_LOG2;
    let centre = ((2 * texel + 1) << CELL_FRACTION_LOG2 >> shift) - (1 << (CELL_FRACTION_LOG2 - 1));
    (centre >> CELL_FRACTION_LOG2, centre & ((1 << CELL_FRACTION_LOG2) - 1))
}

/// All children of a rectangle of parents, in the level `2^width_log2` texels wide; `coarser` holds the parents
/// and their neighbours.
fn refine(base: &Base, width_log2: u32, coarser: &Region, parents: Rectangle) -> Region {
    let (left, top, width, height) = parents;
    let mut children = Region::new(2 * left, 2 * top, 2 * width, 2 * height);
    let size = level_size(width_log2);
    let half_turn = i64::from(size[0] / 2);
    // A row beyond a pole lies half a turn away: it has other columns.
    let table = |turn: i64| -> Vec<Column> {
        let true_column = move |x: i64| (x + turn).rem_euclid(i64::from(size[0])) as u32;
        columns(width_log2, (children.left..children.left + children.width as i64).map(true_column))
    };
    let straight = table(0);
    let crosses_a_pole = top < 0 || top + height as i64 > i64::from(size[1] / 2);
    let turned = if crosses_a_pole { table(half_turn) } else { Vec::new() };

    let strength_columns = StrengthColumns::new(width_log2 - 1, left, width);
    let mut four_noises = vec![[0i32; 4]; width];
    for (index, lines) in children.texels.chunks_exact_mut(4 * width).enumerate() {
        let y = top + index as i64;
        let beyond_a_pole = y < 0 || y >= i64::from(size[1] / 2);
        let columns = if beyond_a_pole { &turned } else { &straight };
        let [north, south] = [2 * y, 2 * y + 1].map(|y| row(width_log2, true_texel(size, 0, y)[1]));
        for (four, columns) in four_noises.iter_mut().zip(columns.as_chunks().0) {
            let [west, east]: [Column; 2] = *columns;
            *four = [
                noise(width_log2, north, west),
                noise(width_log2, north, east),
                noise(width_log2, south, west),
                noise(width_log2, south, east),
            ];
        }
        let strength = StrengthRow::new(base, width_log2 - 1, y, &strength_columns);
        let (north_line, south_line) = lines.split_at_mut(2 * width);
        let around = [coarser.row(left - 1, y - 1), coarser.row(left - 1, y), coarser.row(left - 1, y + 1)];
        for x in 0..width {
            let [nw, ne, sw, se] = four_noises[x];
            let coefficients = [ne + se - nw - sw, sw + se - nw - ne, nw + se - ne - sw];
            let strength = strength.at(x);
            for channel in 0..3 {
                let near = |line: usize| {
                    let line = &around[line][x..x + 3];
                    [line[0][channel], line[1][channel], line[2][channel]]
                };
                let four = split(near(0), near(1), near(2), coefficients, strength[channel]);
                north_line[2 * x][channel] = four[0];
                north_line[2 * x + 1][channel] = four[1];
                south_line[2 * x][channel] = four[2];
                south_line[2 * x + 1][channel] = four[3];
            }
        }
    }
    children
}

/// The children (north-west, north-east, south-west, south-east) of the middle of 3 x 3 texels, for noise
/// coefficients in units of [`NOISE_RMS`] and a relative strength in units of 1/[`STRENGTH_ONE`].
#[inline(always)]
fn split(north: [i32; 3], middle: [i32; 3], south: [i32; 3], noise: [i32; 3], strength: i64) -> [i32; 4] {
    let parent = middle[1];
    let [a, b, c] = predicted(north, [middle[0], middle[2]], south);
    // Products of 2^24 and 2^20, of 2^24 and 2^17: within i64. Division (not a shift) rounds towards zero, so
    // that a mirrored row gets the mirrored detail.
    let amplitude = i64::from(parent) * strength / STRENGTH_ONE;
    let scaled = |coefficient: i32| (i64::from(coefficient) * amplitude / NOISE_RMS) as i32;
    let mut detail = [a + scaled(noise[0]), b + scaled(noise[1]), c + scaled(noise[2])];
    let room = parent.min(LINEAR_ONE - parent);
    let reach = detail[0].abs() + detail[1].abs() + detail[2].abs();
    if reach > room {
        // One division a texel: 2^24 * 2^30 in i64, rounded down, so that the sum stays within the room.
        let ratio = (i64::from(room) << 30) / i64::from(reach);
        for coefficient in &mut detail {
            let shrunk = ((i64::from(coefficient.abs()) * ratio) >> 30) as i32;
            *coefficient = shrunk * coefficient.signum();
        }
    }
    let [a, b, c] = detail;
    [parent - a - b + c, parent + a - b - c, parent - a + b - c, parent + a + b + c]
}

/// Where a run of parents lies in the strength map: the two cells beside each, and the weight of the second.
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

/// The strength map along one row of parents, blended from the two rows of cells beside it.
struct StrengthRow<'a> {
    /// The cells of a row, and what to add to a column there: half a turn beyond a pole.
    rows: [(&'a [[u32; 3]], usize); 2],
    columns: &'a StrengthColumns,
    south: i64,
}

impl<'a> StrengthRow<'a> {
    fn new(base: &'a Base, width_log2: u32, y: i64, columns: &'a StrengthColumns) -> Self {
        let size = level_size(CELLS_LOG2);
        let width = size[0] as usize;
        let (row, south) = cell_weight(y, width_log2);
        let line = |row: i64| {
            let [turn, row] = true_texel(size, 0, row).map(|at| at as usize);
            (&base.strength[row * width..][..width], turn)
        };
        Self { rows: [line(row), line(row + 1)], columns, south }
    }

    /// The relative strength of each channel, in units of 1/[`STRENGTH_ONE`].
    #[inline(always)]
    fn at(&self, x: usize) -> [i64; 3] {
        let (cells, east) = self.columns.0[x];
        let one = 1i64 << CELL_FRACTION_LOG2;
        let mut strength = [0; 3];
        for ((row, turn), row_weight) in self.rows.iter().zip([one - self.south, self.south]) {
            for (cell, weight) in cells.iter().zip([one - east, east]) {
                let cell = row[(cell + turn) & ((1 << CELLS_LOG2) - 1)];
                for channel in 0..3 {
                    strength[channel] += i64::from(cell[channel]) * row_weight * weight;
                }
            }
        }
        [0, 1, 2].map(|channel| strength[channel] >> (2 * CELL_FRACTION_LOG2))
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
        let middle = (1 << 14) - 256;
        let columns = columns(width_log2, 0..1 << width_log2);
        let (mut sum, mut count) = (0.0, 0.0);
        for y in (middle..middle + 512).step_by(2) {
            let rows = [row(width_log2, y), row(width_log2, y + 1)];
            for x in (0..columns.len()).step_by(2) {
                let [[nw, ne], [sw, se]] =
                    rows.map(|row| [0, 1].map(|side| noise(width_log2, row, columns[x + side])));
                for coefficient in [ne + se - nw - sw, sw + se - nw - ne, nw + se - ne - sw] {
                    sum += f64::from(coefficient).powi(2);
                    count += 1.0;
                }
            }
        }
        let found = f64::sqrt(sum / count);
        assert!((found / NOISE_RMS as f64 - 1.0).abs() < 0.01, "{found}");
    }

    proptest! {
        #[test]
        fn the_mean_of_four_children_is_their_parent_exactly_and_none_leaves_the_range(
            near in prop::array::uniform3(prop::array::uniform3(0..=LINEAR_ONE)),
            noise in prop::array::uniform3(-131_072..=131_072i32),
            strength in 0..=STRENGTH_ONE,
        ) {
            let children = split(near[0], near[1], near[2], noise, strength);
            prop_assert_eq!(children.iter().sum::<i32>(), 4 * near[1][1]);
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
            for y in parents.top + 1..parents.top + height - 1 {
                for x in parents.left + 1..parents.left + parents.width as i64 - 1 {
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
