//! Labels of the overlay of levels: level, row and column of the tiles that are visible at the points of a coarse grid.
//! The tiles are read back two frames later, when the frame that copied them has ended, so nothing waits.

use ortelius::frame::{PerFrame, View};
use ortelius::vk::{Buffer, BufferUse, Frame, Gpu, Image, Result, TexelCopy};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// Pixels between two points of the grid.
const STEP: u32 = 48;

/// Width and height of a label, with its margin, in points.
const LABEL: [f32; 2] = [72.0, 16.0];

/// Bytes of a texel of the overlay's image: four words.
const STRIDE: u64 = 16;

/// Level, row and column.
type Tile = [u32; 3];

/// A tile, and the mean position of the grid points at which it is visible, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Label {
    pub at: [f32; 2],
    pub tile: Tile,
}

#[derive(Default)]
pub struct Labels {
    asked: PerFrame<Option<(Buffer, Vec<[u32; 2]>)>>,
    pub found: Vec<Label>,
}

impl Labels {
    /// Reads the tiles that were copied two frames ago, and copies those of this frame. `words` is the image that
    /// [`super::levels`] draws; only its part left of column `split` is copied.
    ///
    /// # Errors
    /// Out of memory.
    pub fn step(
        &mut self,
        gpu: &Gpu,
        frame: &mut Frame<'_>,
        view: &View,
        (words, split): (Option<&Image>, u32),
    ) -> Result<()> {
        let asked = self.asked[view.slot()].take();
        let Some(words) = words else {
            self.found.clear();
            return Ok(());
        };
        if let Some((buffer, points)) = asked {
            let tiles = buffer.mapped::<[u32; 4]>();
            let tile = |n: usize| {
                let [level, row, column, _] = tiles[n];
                (level != u32::MAX).then_some([level, row, column])
            };
            self.found = labels(points.iter().enumerate().filter_map(|(n, at)| Some((*at, tile(n)?))));
        }
        let [columns, rows] = view.size.map(|side| side / STEP);
        let at = |column: u32, row: u32| [column * STEP + STEP / 2, row * STEP + STEP / 2];
        let points = (0..rows).flat_map(|row| (0..columns).map(move |column| at(column, row)));
        let points: Vec<[u32; 2]> = points.filter(|at| at[0] < split).collect();
        if points.is_empty() {
            return Ok(());
        }
        let buffer = gpu.buffer("tile labels", STRIDE * points.len() as u64, BufferUse::Readback)?;
        let copy = |(n, at): (u64, &[u32; 2])| TexelCopy {
            offset: STRIDE * n,
            mip: 0,
            layer: 0,
            at: *at,
            size: [1, 1],
        };
        let copies: Vec<TexelCopy> = (0..).zip(&points).map(copy).collect();
        frame.pass("tile labels", |cmd| cmd.copy_from_image(words, &buffer, &copies))?;
        self.asked[view.slot()] = Some((buffer, points));
        Ok(())
    }
}

/// One label for each tile, in the middle of its points; tiles with the most points first.
fn labels(points: impl Iterator<Item = ([u32; 2], Tile)>) -> Vec<Label> {
    let mut sums: BTreeMap<Tile, ([u32; 2], u32)> = BTreeMap::new();
    for (at, tile) in points {
        let (sum, count) = sums.entry(tile).or_default();
        *sum = [0, 1].map(|axis| sum[axis] + at[axis]);
        *count += 1;
    }
    let mut sums: Vec<_> = sums.into_iter().collect();
    sums.sort_by_key(|(_, (_, count))| Reverse(*count));
    let label = |(tile, (sum, count)): (Tile, ([u32; 2], u32))| Label {
        at: sum.map(|sum| sum as f32 / count as f32),
        tile,
    };
    sums.into_iter().map(label).collect()
}

/// The labels without those that would cover an earlier label.
pub fn without_overlaps(labels: &[Label], pixels_per_point: f32) -> Vec<Label> {
    let size = LABEL.map(|points| points * pixels_per_point);
    let mut shown: Vec<Label> = Vec::new();
    for label in labels {
        let covers =
            |other: &Label| [0, 1].iter().all(|&axis| (label.at[axis] - other.at[axis]).abs() < size[axis]);
        if !shown.iter().any(covers) {
            shown.push(*label);
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_has_one_label_in_the_middle_of_its_points() {
        let points = [([24, 24], [3, 1, 2]), ([72, 24], [3, 1, 2]), ([120, 24], [3, 1, 3])];
        let found = labels(points.into_iter());
        let expected = [([48.0, 24.0], [3, 1, 2]), ([120.0, 24.0], [3, 1, 3])];
        assert_eq!(found, expected.map(|(at, tile)| Label { at, tile }));
    }
    #[test]
    fn where_two_labels_overlap_the_label_with_more_points_stays() {
        let points =
            [([24, 24], [1, 0, 0]), ([72, 24], [2, 0, 0]), ([120, 24], [2, 0, 0]), ([24, 72], [1, 1, 0])];
        let found = labels(points.into_iter());
        let expected = [([96.0, 24.0], [2, 0, 0]), ([24.0, 24.0], [1, 0, 0]), ([24.0, 72.0], [1, 1, 0])];
        let expected = expected.map(|(at, tile)| Label { at, tile });
        assert_eq!(found, expected);
        // With one pixel per point, the labels just do not overlap. With two pixels per point, each label is twice as
        // wide.
        assert_eq!(without_overlaps(&found, 1.0), expected);
        assert_eq!(without_overlaps(&found, 2.0), [expected[0], expected[2]]);
    }
}
