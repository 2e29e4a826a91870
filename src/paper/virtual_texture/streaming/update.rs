//! The update (paper 1, section 3): for each visible tile, load it, upload it, wait for it or refresh it.

use super::tables::{QUEUED, TileAction, action};
use super::upload::Waiting;
use super::wanted::{LOWER_AFTER, fitting_bias, wanted_tiles};
use super::{Order, Streaming, StreamingCounts};
use crate::math::pyramid::TileId;
use std::collections::HashSet;

/// A camera rests after this number of frames with lifted budgets.
const AT_REST: u32 = 10;

impl Streaming {
    /// Chooses the tiles that this frame wants.
    pub(super) fn choose(&mut self, visible: &[TileId], report: &mut StreamingCounts) {
        let (constant, first_resident) = (self.config.level_bias, self.pyramid.first_resident_level());
        report.tiles = visible.iter().collect::<HashSet<_>>().len();
        let capacity = self.config.gpu_tiles;
        let fitting = |capacity| fitting_bias(visible, constant, first_resident, capacity);
        let fits = fitting(capacity);
        // A camera at rest gets a lower bias at once, because its picture then changes only once. A camera that moves
        // in every second frame does not rest.
        self.frames_at_rest = if self.lifted { self.frames_at_rest + 1 } else { 0 };
        let after = if self.frames_at_rest > AT_REST { 1 } else { LOWER_AFTER };
        report.bias = self.bias.next(visible, capacity, after, fitting);
        report.oversubscribed = fits > constant;
        report.bias_held = report.bias > fits;
        self.bias_held = report.bias_held;
        self.wanted = wanted_tiles(visible, report.bias, first_resident, &self.failed);
        if self.config.order == Order::Coarsest {
            self.wanted.sort_by_key(|tile| std::cmp::Reverse(tile.level));
        }
        self.wanted_set = self.wanted.iter().copied().collect();
        report.wanted = self.wanted.len();
        assert!(
            self.wanted.len() <= self.config.gpu_tiles as usize,
            "{} tiles wanted at bias {}, but the tile pool has {} slots",
            self.wanted.len(),
            report.bias,
            self.config.gpu_tiles
        );
    }

    /// Runs the update for the visible tiles.
    pub(super) fn update(&mut self, visible: &[TileId], report: &mut StreamingCounts) {
        let (shown, now) = (self.shown_time(), self.wanted_time());
        for &tile in visible {
            if let Some(slot) = self.shown_slot(tile) {
                self.tile_pool.touch(slot, shown);
            }
        }
        let wanted = std::mem::take(&mut self.wanted);
        report.hits = wanted.iter().filter(|&&tile| self.request(tile, now) == TileAction::Refresh).count();
        self.wanted = wanted;
        report.misses = self.wanted.len() - report.hits;
    }

    /// Applies one row of the update's table; `now` becomes the time of use of a resident tile.
    pub(super) fn request(&mut self, tile: TileId, now: u64) -> TileAction {
        let (gpu_state, host_state) = (self.gpu_states.get(tile), self.host_states.get(tile));
        let action = action(gpu_state, host_state);
        match action {
            TileAction::Load => {
                self.load_queue.push_back(tile);
                self.host_states.set(tile, QUEUED);
            }
            TileAction::Upload => {
                let slot = host_state as u32;
                self.host_cache.slots.pin(slot);
                self.upload_queue.push_back(Waiting {
                    tile,
                    slot,
                    generation: self.host_cache.slots.generation(slot),
                });
                self.gpu_states.set(tile, QUEUED);
            }
            TileAction::Wait => {}
            TileAction::Refresh => {
                self.tile_pool.touch(gpu_state as u32, now);
                if host_state >= 0 {
                    self.host_cache.slots.touch(host_state as u32, now);
                }
            }
        }
        action
    }

    /// The slot that is shown for `tile` now: its own, or that of its nearest coarser tile. `None` if the resident
    /// tail is shown.
    fn shown_slot(&self, tile: TileId) -> Option<u32> {
        (0..self.pyramid.first_resident_level() - tile.level)
            .map(|levels| self.gpu_states.get(tile.ancestor(levels)))
            .find(|&gpu_state| gpu_state >= 0)
            .map(|gpu_state| gpu_state as u32)
    }
}
