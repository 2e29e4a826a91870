//! Tiles that are not visible yet, but will be soon: fetched with what the visible ones leave (ours, an option).
//!
//! They go through A1, A2 and A3 like all others, but after them: behind them in both queues, into slots of `J1` and
//! places of `J2` that nothing of this frame is using, and with so few loads under way that a visible tile never waits
//! long for one. A wrong guess costs time that nobody needed, and a tile that nobody sees.

use super::slots::Claim;
use super::wanted::wanted_tiles;
use super::{FrameReport, Streaming};
use crate::math::pyramid::TileId;

/// Loads under way beside which none ahead is begun: a visible tile finds the threads busy with so many at most.
const MOST_UNDER_WAY: u64 = 4;

impl Streaming {
    /// Chooses the tiles to fetch ahead, as many as `J1` has slots for beside the wanted ones, and does A1 for them.
    /// Comes before A1 of the visible ones, which then are the more recently used.
    pub(super) fn ask_ahead(&mut self, ahead: &[TileId], report: &mut FrameReport) {
        let first_resident = self.pyramid.first_resident_level();
        let room = self.config.gpu_tiles as usize - self.wanted.len();
        let chosen: Vec<TileId> = wanted_tiles(ahead, report.bias, first_resident, &self.failed)
            .into_iter()
            .filter(|tile| !self.wanted_set.contains(tile))
            .take(room)
            .collect();
        let now = self.ahead_now();
        for &tile in &chosen {
            self.request(tile, now);
        }
        report.ahead = chosen.len();
        self.ahead = chosen.into_iter().collect();
    }

    /// Whether a queue may keep the tile.
    pub(super) fn needed(&self, tile: TileId) -> bool {
        self.wanted_set.contains(&tile) || self.ahead.contains(&tile)
    }

    /// A place in `J2` for a load ahead: one that nothing of this frame uses.
    pub(super) fn host_claim_ahead(&self) -> Option<Claim> {
        // Where frames wait for their loads, the budget alone counts: the visible ones have had theirs.
        let few = self.config.deterministic || self.loader.under_way() < MOST_UNDER_WAY;
        few.then(|| self.j2.slots.claimable(self.ahead_now())).flatten()
    }
}
