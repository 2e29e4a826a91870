//! From the list of visible triples to the tiles that are to be streamed: repeats, the level bias and
//! failed tiles.

use crate::math::pyramid::TileId;
use crate::paper::virtual_texture::choices::Keying;
use std::collections::HashSet;

/// The tiles that triples `[q, i, j]` name, each once, in the order of [`TileId`]. Triples of levels from
/// `first_resident_level` up (also `u32::MAX`, the background of `U1`) need no tile and are left out.
pub fn distinct_tiles(triples: &[[u32; 3]], keying: Keying, first_resident_level: u32) -> Vec<TileId> {
    let mut tiles: Vec<TileId> = triples
        .iter()
        .filter(|triple| triple[0] < first_resident_level)
        .map(|&[level, i, j]| match keying {
            // Section 3: i' = floor(i / 2^q), j' = floor(j / 2^q).
            Keying::Paper => TileId { level, row: i >> level, column: j >> level },
            Keying::Native => TileId { level, row: i, column: j },
        })
        .collect();
    tiles.sort_unstable();
    tiles.dedup();
    tiles
}

/// How many levels coarser than asked for the tiles must be taken to be `capacity` at most: the smallest
/// bias, not below `least`, at which the distinct ancestors below `first_resident_level` fit.
///
/// A function of the visible set alone. It has no memory, so it cannot hunt: the same set gives the same
/// bias whatever came before, and where the set fits again the bias is `least` again in the same frame.
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
    // Ends: a bias of first_resident_level leaves no tile.
    let least = least.min(first_resident_level);
    (least..=first_resident_level).find(|&bias| fits(bias)).unwrap_or(first_resident_level)
}

/// The tiles to stream for `visible`: each one's ancestor by `bias` levels, or where that has failed its
/// nearest coarser tile that has not; each once, in the order of `visible`. Not more than without
/// failures, since several tiles may share a substitute but none has two.
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
        assert_eq!(distinct_tiles(&cells, Keying::Paper, 5), [tile(0, 4, 8), tile(2, 1, 2)]);
    }

    #[test]
    fn both_keyings_name_the_same_tiles() {
        let paper = [[1, 5, 9], [0, 5, 9], [1, 4, 8]];
        let native = [[1, 2, 4], [0, 5, 9]];
        assert_eq!(distinct_tiles(&paper, Keying::Paper, 5), distinct_tiles(&native, Keying::Native, 5));
        // ... and one read with the other's key does not.
        assert_ne!(distinct_tiles(&paper, Keying::Native, 5), distinct_tiles(&native, Keying::Native, 5));
    }

    #[test]
    fn background_and_resident_levels_need_no_tile() {
        let triples = [[u32::MAX, 0, 0], [5, 0, 0], [6, 0, 0]];
        assert_eq!(distinct_tiles(&triples, Keying::Paper, 5), []);
        assert_eq!(distinct_tiles(&[], Keying::Native, 5), []);
    }

    #[test]
    fn the_bias_is_the_smallest_that_fits() {
        let visible: Vec<TileId> =
            (0..4).flat_map(|row| (0..4).map(move |column| tile(0, row, column))).collect();
        for (capacity, bias) in [(16, 0), (15, 1), (4, 1), (3, 2), (1, 2), (0, 4)] {
            assert_eq!(fitting_bias(&visible, 0, 4, capacity), bias, "capacity {capacity}");
        }
        assert_eq!(fitting_bias(&visible, 3, 4, 16), 3, "the user's constant holds");
        assert_eq!(fitting_bias(&visible, 9, 4, 16), 4, "nothing is coarser than resident");
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
