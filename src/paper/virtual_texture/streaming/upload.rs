//! The upload step (paper 1, section 3): copies tiles from main memory to video memory, within the frame's budget.

use super::slots::AvailableSlot;
use super::tables::ABSENT;
use super::{Streaming, StreamingCounts};
use crate::math::pyramid::TileId;
use std::collections::VecDeque;
use std::time::Instant;

/// Copies texels into video memory.
pub trait Uploader {
    /// Copies one tile, as [`read_tile`](crate::texture::source::TileSource::read_tile) returns it, into slot `slot` of
    /// the tile pool before this frame is textured. Returns false if this frame has no room left; the tile is then
    /// offered again in the next frame.
    fn upload(&mut self, slot: u32, tile: TileId, bytes: &[u8]) -> bool;
}

/// An entry of the upload queue: a tile of the host cache that waits to be copied to the tile pool.
#[derive(Clone, Copy)]
pub(super) struct Waiting {
    pub tile: TileId,
    pub slot: u32,
    pub generation: u64,
}

impl Streaming {
    /// Uploads queued tiles until the budget is spent.
    pub(super) fn upload(&mut self, uploader: &mut dyn Uploader, report: &mut StreamingCounts) {
        let begin = Instant::now();
        let (kept, dropped): (VecDeque<_>, VecDeque<_>) =
            std::mem::take(&mut self.upload_queue).into_iter().partition(|waiting| self.needed(waiting.tile));
        self.upload_queue = kept;
        self.drop_waiting(dropped);
        // Visible tiles come before prefetched ones.
        self.upload_queue.make_contiguous().sort_by_key(|waiting| !self.wanted_set.contains(&waiting.tile));
        while let Some(&Waiting { tile, slot: host_slot, generation }) = self.upload_queue.front() {
            let spent = match self.config.deterministic {
                true => report.uploads >= self.config.upload_tiles_per_frame as usize,
                false => !self.lifted && report.uploads > 0 && begin.elapsed() >= self.config.upload_budget(),
            };
            if spent {
                break;
            }
            assert!(
                self.host_cache.expects(tile, host_slot, generation),
                "queued {tile:?} lost slot {host_slot} of the host cache"
            );
            let seen = self.wanted_set.contains(&tile);
            let own = if seen { self.wanted_time() } else { self.prefetch_time() };
            let claim = match self.tile_pool.claimable(own) {
                Some(claim) => claim,
                None => {
                    let (wanted, slots) = (self.wanted.len(), self.tile_pool.capacity());
                    assert!(!seen, "{wanted} wanted tiles fill the tile pool of {slots} slots");
                    break;
                }
            };
            if !uploader.upload(claim.slot, tile, self.host_cache.bytes(host_slot)) {
                break;
            }
            self.upload_queue.pop_front();
            self.place(claim, tile, own, report);
            self.host_cache.slots.touch(host_slot, own);
            report.uploads += 1;
            report.ahead_uploads += usize::from(!seen);
            report.upload_bytes += self.tile_bytes as u64;
        }
        // Prefetched tiles leave the queue, because they would pin host-cache slots while the tile pool is full.
        let (kept, dropped): (VecDeque<_>, VecDeque<_>) = std::mem::take(&mut self.upload_queue)
            .into_iter()
            .partition(|waiting| self.wanted_set.contains(&waiting.tile));
        self.upload_queue = kept;
        self.drop_waiting(dropped);
    }

    /// For tiles that have left the upload queue without an upload: returns their state to -2 and unpins their slots in
    /// the host cache.
    fn drop_waiting(&mut self, dropped: VecDeque<Waiting>) {
        for waiting in dropped {
            self.gpu_states.set(waiting.tile, ABSENT);
            self.host_cache.slots.touch(waiting.slot, self.prefetch_time());
        }
    }

    /// Gives an uploaded tile its slot of the tile pool, with `now` as its time of use.
    fn place(&mut self, claim: AvailableSlot, tile: TileId, now: u64, report: &mut StreamingCounts) {
        if let Some(evicted) = claim.evicts {
            self.gpu_states.set(evicted, ABSENT);
            self.page_table_changes.push((evicted, None));
            report.gpu_evictions += 1;
        }
        self.tile_pool.claim(claim, tile);
        self.tile_pool.touch(claim.slot, now);
        self.gpu_states.set(tile, claim.slot as i32);
        self.page_table_changes.push((tile, Some(claim.slot)));
    }
}
