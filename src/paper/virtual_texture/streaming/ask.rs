//! A1: each frame, for each visible tile, what is to be done (paper 1, section 3).

use super::tables::{Action, QUEUED, action};
use super::upload::Waiting;
use super::wanted::{fitting_bias, wanted_tiles};
use super::{FrameReport, Order, Streaming};
use crate::math::pyramid::TileId;
use std::collections::HashSet;

impl Streaming {
    /// Which tiles this frame wants.
    pub(super) fn choose(&mut self, visible: &[TileId], report: &mut FrameReport) {
        let (constant, first_resident) = (self.config.level_bias, self.pyramid.first_resident_level());
        report.tiles = visible.iter().collect::<HashSet<_>>().len();
        report.bias = fitting_bias(visible, constant, first_resident, self.config.gpu_tiles);
        report.oversubscribed = report.bias > constant;
        self.wanted = wanted_tiles(visible, report.bias, first_resident, &self.failed);
        if self.config.order == Order::Coarsest {
            self.wanted.sort_by_key(|tile| std::cmp::Reverse(tile.level));
        }
        self.wanted_set = self.wanted.iter().copied().collect();
        report.wanted = self.wanted.len();
        assert!(
            self.wanted.len() <= self.config.gpu_tiles as usize,
            "{} tiles wanted at bias {}, N1 = {}",
            self.wanted.len(),
            report.bias,
            self.config.gpu_tiles
        );
    }

    /// A1.
    pub(super) fn ask(&mut self, visible: &[TileId], report: &mut FrameReport) {
        let (shown, now) = (self.shown_now(), self.wanted_now());
        for &tile in visible {
            if let Some(slot) = self.shown_slot(tile) {
                self.j1.touch(slot, shown);
            }
        }
        let wanted = std::mem::take(&mut self.wanted);
        report.hits = wanted.iter().filter(|&&tile| self.request(tile, now) == Action::Refresh).count();
        self.wanted = wanted;
        report.misses = self.wanted.len() - report.hits;
    }

    /// One row of A1's table; `now` is the time of use of a tile that is there.
    pub(super) fn request(&mut self, tile: TileId, now: u64) -> Action {
        let (k1, k2) = (self.h1.get(tile), self.h2.get(tile));
        let action = action(k1, k2);
        match action {
            Action::Load => {
                self.q2.push_back(tile);
                self.h2.set(tile, QUEUED);
            }
            Action::Upload => {
                let slot = k2 as u32;
                self.j2.slots.pin(slot);
                self.q1.push_back(Waiting { tile, slot, generation: self.j2.slots.generation(slot) });
                self.h1.set(tile, QUEUED);
            }
            Action::Wait => {}
            Action::Refresh => {
                self.j1.touch(k1 as u32, now);
                if k2 >= 0 {
                    self.j2.slots.touch(k2 as u32, now);
                }
            }
        }
        action
    }

    /// The slot that is shown for `tile` now: its own, or its nearest coarser tile's. None: `G1`.
    fn shown_slot(&self, tile: TileId) -> Option<u32> {
        (0..self.pyramid.first_resident_level() - tile.level)
            .map(|levels| self.h1.get(tile.ancestor(levels)))
            .find(|&k1| k1 >= 0)
            .map(|k1| k1 as u32)
    }
}
