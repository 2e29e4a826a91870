//! The state tables of the two caches and the rule of the update (paper 1, section 3).

use crate::math::pyramid::{Pyramid, TileId};

/// The paper's -1: absent, but queued for upload (tile pool), or queued for loading or being loaded (host cache).
pub const QUEUED: i32 = -1;
/// The paper's -2: absent and not queued.
pub const ABSENT: i32 = -2;

/// The states of one cache for every streamed level q: the cell `(i', j')` holds the state of the tile `(i', j')`. The
/// state is the tile's slot `k >= 0`, [`QUEUED`] or [`ABSENT`].
///
/// The shader reads the page table, not these states. The paper writes a coarser tile's slot into the cell of a missing
/// tile; the update would then treat the missing tile as present.
pub struct StateTable {
    pyramid: Pyramid,
    /// The cells of each level, row by row.
    levels: Vec<Vec<i32>>,
}

impl StateTable {
    /// A table with all tiles absent.
    pub fn new(pyramid: Pyramid) -> Self {
        let cells = |level| pyramid.tile_grid(level).map(|side| side as usize).iter().product();
        let levels = (0..pyramid.first_resident_level()).map(|level| vec![ABSENT; cells(level)]).collect();
        Self { pyramid, levels }
    }

    fn cell(&self, tile: TileId) -> usize {
        assert!(self.pyramid.contains(tile), "{tile:?} is no tile of {:?}", self.pyramid);
        tile.row as usize * self.pyramid.tile_grid(tile.level)[0] as usize + tile.column as usize
    }

    /// The state of a tile: its slot, [`QUEUED`] or [`ABSENT`].
    pub fn get(&self, tile: TileId) -> i32 {
        self.levels[tile.level as usize][self.cell(tile)]
    }

    /// Changes the state. A tile is requested (`-2 -> -1`), arrives (`-1 -> k`), is dropped from its queue (`-1 -> -2`)
    /// or is evicted (`k -> -2`). Other changes panic.
    pub fn set(&mut self, tile: TileId, to: i32) {
        let from = self.get(tile);
        assert!(
            matches!((from, to), (ABSENT, QUEUED) | (QUEUED, ABSENT) | (QUEUED, 0..) | (0.., ABSENT)),
            "{tile:?} may not go from state {from} to {to}"
        );
        let cell = self.cell(tile);
        self.levels[tile.level as usize][cell] = to;
    }

    /// Every tile that is not [`ABSENT`], with its state, in the order of [`TileId`].
    pub fn present(&self) -> impl Iterator<Item = (TileId, i32)> + '_ {
        self.levels.iter().enumerate().flat_map(|(level, cells)| {
            let level = level as u32;
            let columns = self.pyramid.tile_grid(level)[0];
            cells.iter().enumerate().filter(|(_, k)| **k != ABSENT).map(move |(cell, &k)| {
                (TileId { level, row: cell as u32 / columns, column: cell as u32 % columns }, k)
            })
        })
    }
}

/// What the update does with a wanted tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileAction {
    /// Append the tile to the load queue; `k2 := -1`.
    Load,
    /// Append the tile to the upload queue; `k1 := -1`.
    Upload,
    /// Nothing: the tile is queued or being loaded.
    Wait,
    /// Refresh the time of use: the tile is in the tile pool.
    Refresh,
}

/// The table of the update, row by row (paper 1, section 3).
pub fn action(gpu_state: i32, host_state: i32) -> TileAction {
    match (gpu_state, host_state) {
        (ABSENT, ABSENT) => TileAction::Load,
        (ABSENT, 0..) => TileAction::Upload,
        (ABSENT, QUEUED) => TileAction::Wait,
        (QUEUED, _) => TileAction::Wait,
        (0.., _) => TileAction::Refresh,
        _ => panic!("tile pool {gpu_state}, host cache {host_state}: not a valid state"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_five_rows_match_the_paper() {
        assert_eq!(action(-2, -2), TileAction::Load);
        assert_eq!(action(-2, 7), TileAction::Upload);
        assert_eq!(action(-2, 0), TileAction::Upload);
        assert_eq!(action(-2, -1), TileAction::Wait);
        for host_state in [-2, -1, 0, 7] {
            assert_eq!(action(-1, host_state), TileAction::Wait);
            assert_eq!(action(0, host_state), TileAction::Refresh);
            assert_eq!(action(7, host_state), TileAction::Refresh);
        }
    }

    fn table() -> StateTable {
        StateTable::new(Pyramid::new(7, 6, 4, 2, None).unwrap())
    }

    const TILE: TileId = TileId { level: 1, row: 1, column: 3 };

    #[test]
    fn a_cell_belongs_to_one_tile() {
        let mut table = table();
        table.set(TILE, QUEUED);
        table.set(TILE, 5);
        assert_eq!(table.present().collect::<Vec<_>>(), [(TILE, 5)]);
        table.set(TILE, ABSENT);
        assert_eq!(table.present().count(), 0);
    }

    #[test]
    #[should_panic(expected = "may not go from state -2 to 3")]
    fn a_tile_that_was_not_requested_does_not_arrive() {
        table().set(TILE, 3);
    }

    #[test]
    #[should_panic(expected = "is no tile of")]
    fn a_tile_outside_the_grid_has_no_state() {
        table().get(TileId { level: 1, row: 2, column: 0 });
    }
}
