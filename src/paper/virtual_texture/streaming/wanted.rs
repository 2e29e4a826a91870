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

/// The smallest level bias, at least `least`, for which at most `capacity` distinct tiles finer than
/// `first_resident_level` remain.
///
/// The bias depends only on the visible set and keeps no state, so it cannot oscillate. As soon as the set fits again,
/// the bias is `least` again.
pub fn fitting_bias(visible: &[TileId], least: u32, first_resident_level: u32, capacity: u32) -> u32 {
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
    let least = least.min(first_resident_level);
    (least..=first_resident_level).find(|&bias| fits(bias)).unwrap_or(first_resident_level)
}

/// The tiles to stream for `visible`, each once, in the order of `visible`: the ancestor by `bias` levels, or its
/// nearest coarser tile that has not failed. Failures never add tiles: each tile has one substitute, which several may
/// share.
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
        // With the wrong address they name other tiles.
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

    #[test]
    fn a_failed_tile_is_replaced_by_its_nearest_coarser_tile() {
        let failed = HashSet::from([tile(0, 0, 0), tile(0, 0, 1), tile(1, 0, 0)]);
        let visible = [tile(0, 0, 0), tile(0, 0, 2), tile(0, 0, 1)];
        assert_eq!(wanted_tiles(&visible, 0, 3, &failed), [tile(2, 0, 0), tile(0, 0, 2)]);
        assert_eq!(wanted_tiles(&visible, 0, 2, &failed), [tile(0, 0, 2)], "level 2 is resident");
        assert_eq!(wanted_tiles(&visible, 1, 3, &failed), [tile(2, 0, 0), tile(1, 0, 1)]);
    }
}
