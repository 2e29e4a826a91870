//! Prefetch (optional, not in the paper): tiles that are expected to become visible use the budget that the visible
//! tiles leave.
//!
//! Expected tiles take the same path as visible ones, but come after them in both queues. They replace only tiles
//! that this frame does not use. Few of their loads are under way at a time, so they hardly delay a visible tile. A
//! wrong prediction costs only idle time and an unused tile.

use super::slots::AvailableSlot;
use super::wanted::wanted_tiles;
use super::{Streaming, StreamingCounts};
use crate::math::pyramid::TileId;

/// No prefetch begins while this many loads are under way, so a visible tile waits for at most this many loads of
/// prefetched tiles.
const MAX_UNDER_WAY: u64 = 4;

impl Streaming {
    /// Chooses the tiles to prefetch and requests them, at most as many as the wanted tiles leave slots in the tile
    /// pool. Runs before the update of the visible tiles, so that the visible tiles are more recently used.
    pub(super) fn prefetch(&mut self, expected: &[TileId], report: &mut StreamingCounts) {
        let first_resident = self.pyramid.first_resident_level();
        let room = self.config.gpu_tiles as usize - self.wanted.len();
        let chosen: Vec<TileId> = wanted_tiles(expected, report.bias, first_resident, &self.failed)
            .into_iter()
            .filter(|tile| !self.wanted_set.contains(tile))
            .take(room)
            .collect();
        let now = self.prefetch_time();
        for &tile in &chosen {
            self.request(tile, now);
        }
        report.expected = chosen.len();
        self.expected = chosen.into_iter().collect();
    }

    /// True if the tile may stay in its queue.
    pub(super) fn needed(&self, tile: TileId) -> bool {
        self.wanted_set.contains(&tile) || self.expected.contains(&tile)
    }

    /// A slot of the host cache for a prefetch: one whose tile this frame does not use.
    pub(super) fn host_claim_for_prefetch(&self) -> Option<AvailableSlot> {
        // A deterministic frame waits for all its loads, so prefetched ones cannot delay a later frame. Only the load
        // budget limits them.
        let few = self.config.deterministic || self.loader.under_way() < MAX_UNDER_WAY;
        few.then(|| self.host_cache.slots.claimable(self.prefetch_time())).flatten()
    }
}
