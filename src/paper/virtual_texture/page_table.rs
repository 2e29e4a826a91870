//! The page table that the shader reads. Each tile of each level has a cell. The cell names the tile itself if the tile
//! is in the tile pool, and otherwise the nearest coarser tile in the tile pool.
//!
//! As in the paper, the cell of a missing tile names the tile that is shown instead, so the shader needs one lookup and
//! no search. The paper stores tile states in the same array (an erratum, see [`super::streaming`]); here tile states
//! and page table are separate. An evicted tile is removed from every cell that names it. This takes time on the host,
//! because up to 4/3 4^q cells name a tile of level q.

use crate::math::pyramid::{Pyramid, TileId};
use std::ops::Range;

/// A cell is `fade << 24 | level << 19 | slot`.
const SLOT_BITS: u32 = 19;

/// The table on the host. Its changes are copied to the device.
pub struct PageTable {
    words: Vec<u32>,
    column_bits: u32,
    row_bits: u32,
    changed: Vec<Range<usize>>,
}

fn word(level: u32, slot: u32, fade: u32) -> u32 {
    assert!(slot < 1 << SLOT_BITS && level < 31 && fade < 256, "level {level}, slot {slot}, fade {fade}");
    fade << 24 | level << SLOT_BITS | slot
}

fn level_of(word: u32) -> u32 {
    word >> SLOT_BITS & 31
}

impl PageTable {
    /// Creates a table that shows the tiles of `resident` from their slots. Their coarsest level must be one tile.
    pub fn new(pyramid: &Pyramid, resident: &[(TileId, u32)]) -> PageTable {
        let [column_bits, row_bits] = PageTable::bits(pyramid);
        let mut table = PageTable {
            // Level 31 does not exist: it marks a cell that is not filled yet.
            words: vec![u32::MAX; 2 << (column_bits + row_bits)],
            column_bits,
            row_bits,
            changed: Vec::new(),
        };
        // Coarsest first: each level falls back on the levels already filled.
        for &(tile, slot) in resident.iter().rev() {
            table.fill(tile, word(tile.level, slot, 0));
        }
        table.changed.clear();
        table
    }

    /// Columns and rows of level 0, as log2.
    fn bits(pyramid: &Pyramid) -> [u32; 2] {
        [pyramid.width_log2(), pyramid.height_log2()].map(|log2| log2 - pyramid.tile_log2())
    }

    /// Bytes of a pyramid's table.
    pub fn bytes(pyramid: &Pyramid) -> u64 {
        let [column_bits, row_bits] = PageTable::bits(pyramid);
        4 * (2 << (column_bits + row_bits))
    }

    /// Columns and rows of a level, as log2.
    fn grid_log2(&self, level: u32) -> [u32; 2] {
        [self.column_bits.saturating_sub(level), self.row_bits.saturating_sub(level)]
    }

    /// Index of a cell: a leading 1, then the bits of row and column. The position of the leading 1 identifies the
    /// level. Single-tile levels share a cell, whose value the shader ignores.
    fn place(&self, level: u32, row: u32, column: u32) -> usize {
        let [column_bits, row_bits] = self.grid_log2(level);
        ((1 << row_bits | row as usize) << column_bits) | column as usize
    }

    fn parent(&self, level: u32, row: u32, column: u32) -> u32 {
        self.words[self.place(level + 1, row >> 1, column >> 1)]
    }

    /// Applies a frame's changes: `fade << 24 | slot + 1`, or 0 for a tile that is no longer shown ([`super::fade`]).
    pub fn apply(&mut self, changes: &[(TileId, u32)]) {
        for &(tile, cell) in changes {
            let shown = match cell {
                0 => self.parent(tile.level, tile.row, tile.column),
                _ => word(tile.level, (cell & 0xff_ffff) - 1, cell >> 24),
            };
            self.fill(tile, shown);
        }
    }

    /// Writes a tile's cell. Then, level by level, every finer cell that lies within the tile and does not show its own
    /// tile gets the word of its parent cell.
    fn fill(&mut self, tile: TileId, shown: u32) {
        let place = self.place(tile.level, tile.row, tile.column);
        self.words[place] = shown;
        self.changed.push(place..place + 1);
        for level in (0..tile.level).rev() {
            let finer = tile.level - level;
            let [column_bits, row_bits] = self.grid_log2(level);
            // A level that is one tile wide or high contains all finer tiles along that axis.
            let within = |at: u32, bits: u32| at << finer..((at + 1) << finer).min(1 << bits);
            let columns = within(tile.column, column_bits);
            for row in within(tile.row, row_bits) {
                let first = self.place(level, row, columns.start);
                for column in columns.clone() {
                    let place = first + (column - columns.start) as usize;
                    if level_of(self.words[place]) != level {
                        self.words[place] = self.parent(level, row, column);
                    }
                }
                self.changed.push(first..first + columns.len());
            }
        }
    }

    /// For each level of more than one tile, finest first: the numbers of cells that show a tile of their own level,
    /// one level coarser, two levels coarser, and at least three levels coarser.
    pub fn cells_by_level(&self) -> Vec<[usize; 4]> {
        let of_level = |level: u32| {
            let cells = 1 << self.grid_log2(level).iter().sum::<u32>();
            let mut counts = [0; 4];
            for word in &self.words[cells..2 * cells] {
                counts[(level_of(*word) - level).min(3) as usize] += 1;
            }
            counts
        };
        (0..self.column_bits.max(self.row_bits)).map(of_level).collect()
    }

    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The ranges that have changed since the last call: sorted, disjoint and not adjacent.
    pub fn take_changes(&mut self) -> Vec<Range<usize>> {
        let mut changed = std::mem::take(&mut self.changed);
        changed.sort_by_key(|range| range.start);
        let mut merged: Vec<Range<usize>> = Vec::with_capacity(changed.len());
        for range in changed {
            match merged.last_mut() {
                Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
                _ => merged.push(range),
            }
        }
        merged
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// 8 x 4 tiles in level 0. Levels 2 and 3 are resident; level 3 is one tile.
    fn pyramid() -> Pyramid {
        Pyramid::new(7, 6, 4, 2, Some(6)).unwrap()
    }

    fn resident(pyramid: &Pyramid) -> Vec<(TileId, u32)> {
        let mut tiles = Vec::new();
        for level in pyramid.first_resident_level()..=3 {
            let [columns, rows] = [8 >> level, (4 >> level).max(1)];
            for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
                tiles.push((TileId { level, row, column }, 100 + tiles.len() as u32));
            }
        }
        tiles
    }

    /// The definition of a cell: the tile itself if it is shown, otherwise the nearest coarser tile that is shown.
    fn nearest(shown: &HashMap<TileId, u32>, mut tile: TileId) -> u32 {
        while !shown.contains_key(&tile) {
            tile = TileId { level: tile.level + 1, row: tile.row >> 1, column: tile.column >> 1 };
        }
        word(tile.level, shown[&tile], 0)
    }

    #[test]
    fn each_cell_names_the_nearest_coarser_tile_and_every_change_is_reported() {
        let pyramid = pyramid();
        let mut shown: HashMap<TileId, u32> = resident(&pyramid).into_iter().collect();
        let mut table = PageTable::new(&pyramid, &resident(&pyramid));
        assert_eq!(table.take_changes(), []);
        assert_eq!(PageTable::bytes(&pyramid), 4 * table.words().len() as u64);
        let mut copy = table.words().to_vec();
        let mut state = 1u32;
        for slot in 0..500 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let level = state >> 30 & 1;
            let [columns, rows] = pyramid.tile_grid(level);
            let tile = TileId { level, row: (state >> 20) % rows, column: (state >> 8) % columns };
            let cell = if shown.remove(&tile).is_none() { slot + 1 } else { 0 };
            if cell > 0 {
                shown.insert(tile, slot);
            }
            table.apply(&[(tile, cell)]);
            for range in table.take_changes() {
                copy[range.clone()].copy_from_slice(&table.words()[range]);
            }
            assert_eq!(copy, table.words());
            for level in 0..3 {
                let [columns, rows] = [8 >> level, (4 >> level).max(1)];
                for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
                    let tile = TileId { level, row, column };
                    let found = copy[table.place(level, row, column)];
                    assert_eq!(found, nearest(&shown, tile), "change {slot}: {tile:?}");
                }
            }
        }
    }

    #[test]
    fn overlapping_changes_of_a_frame_are_reported_once() {
        let pyramid = pyramid();
        let mut table = PageTable::new(&pyramid, &resident(&pyramid));
        let tile = TileId { level: 1, row: 1, column: 3 };
        let within = TileId { level: 0, row: 3, column: 6 };
        table.apply(&[(tile, 5), (within, 6), (tile, 0)]);
        let changes = table.take_changes();
        assert!(changes.windows(2).all(|pair| pair[0].end < pair[1].start), "{changes:?}");
        // The tile's own cell, and its 2 x 2 cells of level 0.
        assert_eq!(changes.iter().map(|range| range.len()).sum::<usize>(), 5);
        assert_eq!(table.words()[table.place(0, 3, 6)], word(0, 5, 0));
        assert_eq!(level_of(table.words()[table.place(0, 2, 6)]), 2);
    }

    #[test]
    fn cells_are_counted_by_how_much_coarser_their_tile_is() {
        let pyramid = Pyramid::new(8, 7, 4, 2, Some(6)).unwrap();
        // 16 x 8 tiles in level 0. Levels 3 (2 x 1 tiles) and 4 (one tile) are resident.
        let resident = [(3, 0), (3, 1), (4, 0)].map(|(level, column)| TileId { level, row: 0, column });
        let mut table = PageTable::new(&pyramid, &resident.map(|tile| (tile, 100 + tile.column)));
        assert_eq!(table.cells_by_level(), [[0, 0, 0, 128], [0, 0, 32, 0], [0, 8, 0, 0], [2, 0, 0, 0]]);
        // A tile of level 2, which covers 4 x 4 cells of level 0; a tile of level 0 within it, which fades in; and a
        // tile of level 1 elsewhere.
        let of = |level, row, column| TileId { level, row, column };
        table.apply(&[(of(2, 1, 3), 5), (of(0, 5, 14), 128 << 24 | 6), (of(1, 0, 0), 7)]);
        let counts = [[1, 4, 15, 108], [1, 4, 27, 0], [1, 7, 0, 0], [2, 0, 0, 0]];
        assert_eq!(table.cells_by_level(), counts);
        table.apply(&[(of(2, 1, 3), 0)]);
        assert_ne!(table.cells_by_level(), counts);
    }

    #[test]
    fn a_fading_tile_fades_in_the_cells_of_its_finer_tiles_too() {
        let pyramid = pyramid();
        let mut table = PageTable::new(&pyramid, &resident(&pyramid));
        table.apply(&[(TileId { level: 1, row: 0, column: 0 }, 128 << 24 | 8)]);
        assert_eq!(table.words()[table.place(0, 1, 1)], word(1, 7, 128));
    }
}
