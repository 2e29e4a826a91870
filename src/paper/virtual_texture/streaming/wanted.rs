//! Turns the list of visible triples into the tiles to stream: removes repeats, applies the level bias and replaces
//! failed tiles.

use crate::math::pyramid::TileId;
use crate::paper::virtual_texture::choices::TileAddress;
use std::collections::HashSet;

/// The tiles of the triples `[q, i, j]`, each once, in the order of [`TileId`]. Triples with q >=
/// `first_resident_level`, including the background (`u32::MAX`), need no tile and are left out.
pub fn distinct_tiles(triples: &[[u32; 3]], address: TileAddress, first_resident_level: u32) -> Vec<TileId> {
    let mut tiles: Vec<TileId> = triples
        .iter()
        .filter(|triple| triple[0] < first_resident_level)
        .map(|&[level, i, j]| match address {
            // Section 3: i' = floor(i / 2^q), j' = floor(j / 2^q).
            TileAddress::Level0 => TileId { level, row: i >> level, column: j >> level },
            TileAddress::OwnLevel => TileId { level, row: i, column: j },
        })
        .collect();
    tiles.sort_unstable();
    tiles.dedup();
    tiles
}

/// The smallest level bias, at least `min`, for which at most `capacity` distinct tiles finer than
/// `first_resident_level` remain.
///
/// The bias depends only on the visible set. [`LevelBias`] smooths it over the frames of a moving picture.
pub fn fitting_bias(visible: &[TileId], min: u32, first_resident_level: u32, capacity: u32) -> u32 {
    let fits = |bias: u32| {
        let mut tiles: Vec<TileId> = visible
            .iter()
            .filter(|tile| tile.level + bias < first_resident_level)
            .map(|tile| tile.ancestor(bias))
            .collect();
        tiles.sort_unstable();
        tiles.dedup();
        tiles.len() <= capacity as usize
    };
    // A bias of first_resident_level leaves no tile, so the search ends.
    let min = min.min(first_resident_level);
    (min..=first_resident_level).find(|&bias| fits(bias)).unwrap_or(first_resident_level)
}

/// Frames in a row for which a lower bias must fit before it is applied.
pub const LOWER_AFTER: u32 = 30;

/// The level bias over the frames. Each change of the bias is visible in the whole picture, so a visible set near the
/// capacity must not change the bias every few frames. The bias rises at once, because the wanted tiles must fit. The
/// bias falls after [`LOWER_AFTER`] frames in a row in which a lower bias fits into 90 % of the capacity. If the
/// visible set does not change, a lower bias only has to fit, so a camera at rest gets the smallest bias that fits.
#[derive(Default)]
pub struct LevelBias {
    bias: u32,
    /// Frames in a row in which a lower bias would fit.
    calm: u32,
    previous: Vec<TileId>,
}

impl LevelBias {
    /// The bias of the next frame. `fitting`: the smallest bias for which the frame's tiles fit a capacity. `after`
    /// replaces [`LOWER_AFTER`].
    pub fn next(
        &mut self,
        visible: &[TileId],
        capacity: u32,
        after: u32,
        fitting: impl Fn(u32) -> u32,
    ) -> u32 {
        let exact = fitting(capacity);
        let rests = visible == self.previous;
        self.previous.clear();
        self.previous.extend_from_slice(visible);
        if exact >= self.bias {
            (self.bias, self.calm) = (exact, 0);
            return self.bias;
        }
        let lower = if rests { exact } else { fitting(capacity * 9 / 10) };
        self.calm = if lower < self.bias { self.calm + 1 } else { 0 };
        if self.calm >= after {
            (self.bias, self.calm) = (lower, 0);
        }
        self.bias
    }
}

/// The tiles to stream for `visible`, each once, in the order of `visible`: the ancestor that is `bias` levels coarser,
/// or, if that tile has failed, its nearest coarser tile that has not failed. Failures never add tiles: each tile has
/// one substitute, which several tiles may share.
pub fn wanted_tiles(
    visible: &[TileId],
    bias: u32,
    first_resident_level: u32,
    failed: &HashSet<TileId>,
) -> Vec<TileId> {
    let mut seen = HashSet::with_capacity(visible.len());
    let streamed = |tile: &TileId| tile.level < first_resident_level;
    visible
        .iter()
        .filter(|tile| tile.level + bias < first_resident_level)
        .filter_map(|tile| {
            let biased = tile.ancestor(bias);
            std::iter::successors(Some(biased), |tile| Some(tile.parent()).filter(streamed))
                .find(|tile| !failed.contains(tile))
        })
        .filter(|&tile| seen.insert(tile))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(level: u32, row: u32, column: u32) -> TileId {
        TileId { level, row, column }
    }

    #[test]
    fn a_tile_listed_for_each_of_its_cells_is_one_tile() {
        let cells: Vec<[u32; 3]> =
            (4..8).flat_map(|i| (8..12).map(move |j| [2, i, j])).chain([[0, 4, 8], [0, 4, 8]]).collect();
        assert_eq!(cells.len(), 18);
        assert_eq!(distinct_tiles(&cells, TileAddress::Level0, 5), [tile(0, 4, 8), tile(2, 1, 2)]);
    }

    #[test]
    fn both_tile_addresses_name_the_same_tiles() {
        let paper = [[1, 5, 9], [0, 5, 9], [1, 4, 8]];
        let own_level = [[1, 2, 4], [0, 5, 9]];
        assert_eq!(
            distinct_tiles(&paper, TileAddress::Level0, 5),
            distinct_tiles(&own_level, TileAddress::OwnLevel, 5)
        );
        // With the wrong address, the same triples name other tiles.
        assert_ne!(
            distinct_tiles(&paper, TileAddress::OwnLevel, 5),
            distinct_tiles(&own_level, TileAddress::OwnLevel, 5)
        );
    }

    #[test]
    fn background_and_resident_levels_need_no_tile() {
        let triples = [[u32::MAX, 0, 0], [5, 0, 0], [6, 0, 0]];
        assert_eq!(distinct_tiles(&triples, TileAddress::Level0, 5), []);
        assert_eq!(distinct_tiles(&[], TileAddress::OwnLevel, 5), []);
    }

    #[test]
    fn the_bias_is_the_smallest_that_fits() {
        let visible: Vec<TileId> =
            (0..4).flat_map(|row| (0..4).map(move |column| tile(0, row, column))).collect();
        for (capacity, bias) in [(16, 0), (15, 1), (4, 1), (3, 2), (1, 2), (0, 4)] {
            assert_eq!(fitting_bias(&visible, 0, 4, capacity), bias, "capacity {capacity}");
        }
        assert_eq!(fitting_bias(&visible, 3, 4, 16), 3, "the user's constant holds");
        assert_eq!(fitting_bias(&visible, 9, 4, 16), 4, "the bias ends at the resident levels");
    }

    /// The biases of frames with these numbers of visible tiles. A bias of 1 halves the number. The capacity is 20, or
    /// 18 with the margin.
    fn biases(counts: &[u32]) -> Vec<u32> {
        let mut bias = LevelBias::default();
        let frame = |&count: &u32| {
            let visible: Vec<TileId> = (0..count).map(|column| tile(0, 0, column)).collect();
            bias.next(&visible, 20, LOWER_AFTER, |capacity| fitting_bias(&visible, 0, 4, capacity))
        };
        counts.iter().map(frame).collect()
    }

    fn changes(biases: &[u32]) -> usize {
        biases.windows(2).filter(|pair| pair[0] != pair[1]).count()
    }

    #[test]
    fn the_bias_rises_at_once_and_falls_after_30_frames_with_a_margin() {
        // Successive frames have different counts.
        let moving = |low: u32, frames: usize| (0..frames).map(move |n| low + n as u32 % 2);
        let counts: Vec<u32> = moving(17, 5).chain([21]).chain(moving(17, 40)).collect();
        let found = biases(&counts);
        assert_eq!(found[..5], [0; 5]);
        assert_eq!(found[5..35], [1; 30]);
        assert_eq!(found[35..], [0; 11]);
        // 19 and 20 tiles fit, but without a margin.
        let counts: Vec<u32> = [21].into_iter().chain(moving(19, 100)).collect();
        assert_eq!(changes(&biases(&counts)), 0);
        // One frame without a margin begins the wait again.
        let counts: Vec<u32> =
            [21].into_iter().chain(moving(16, 29)).chain([19]).chain(moving(16, 29)).collect();
        assert_eq!(changes(&biases(&counts)), 0);
    }

    #[test]
    fn a_set_around_the_capacity_changes_the_bias_once() {
        let counts: Vec<u32> = (0..200).map(|n| 20 + n / 4 % 2).collect();
        assert_eq!(changes(&biases(&counts)), 1);
        let stateless: Vec<u32> = counts.iter().map(|&count| u32::from(count > 20)).collect();
        assert_eq!(changes(&stateless), 49);
    }

    #[test]
    fn a_set_that_does_not_change_gets_the_smallest_bias_that_fits() {
        let found = biases(&[[21].as_slice(), &[20; 40]].concat());
        assert_eq!((&found[..31], &found[31..]), ([1; 31].as_slice(), [0; 10].as_slice()));
    }

    #[test]
    fn a_failed_tile_is_replaced_by_its_nearest_coarser_tile() {
        let failed = HashSet::from([tile(0, 0, 0), tile(0, 0, 1), tile(1, 0, 0)]);
        let visible = [tile(0, 0, 0), tile(0, 0, 2), tile(0, 0, 1)];
        assert_eq!(wanted_tiles(&visible, 0, 3, &failed), [tile(2, 0, 0), tile(0, 0, 2)]);
        assert_eq!(wanted_tiles(&visible, 0, 2, &failed), [tile(0, 0, 2)], "level 2 is resident");
        assert_eq!(wanted_tiles(&visible, 1, 3, &failed), [tile(2, 0, 0), tile(1, 0, 1)]);
    }
}
