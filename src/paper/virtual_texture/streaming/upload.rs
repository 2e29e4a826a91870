//! A2: tiles go from main memory to video memory, under the frame's budget (paper 1, section 3).

use super::slots::Claim;
use super::tables::ABSENT;
use super::{FrameReport, Streaming};
use crate::math::pyramid::TileId;
use std::collections::VecDeque;
use std::time::Instant;

/// The layer that copies texels into video memory.
pub trait Uploader {
    /// Copies one stored tile (as [`read_tile`](crate::texture::source::TileSource::read_tile) gives it) into slot `slot` of `J1`, in this frame,
    /// before anything of this frame is textured. False: no room in this frame; nothing was copied, and the
    /// tile is offered again in the next.
    fn upload(&mut self, slot: u32, tile: TileId, bytes: &[u8]) -> bool;
}

/// A tile of `J2` waiting to be copied to `J1`: an entry of `Q1`.
#[derive(Clone, Copy)]
pub(super) struct Waiting {
    pub tile: TileId,
    pub slot: u32,
    pub generation: u64,
}

impl Streaming {
    /// A2.
    pub(super) fn upload(&mut self, uploader: &mut dyn Uploader, report: &mut FrameReport) {
        let begin = Instant::now();
        let now = self.wanted_now();
        let (kept, dropped): (VecDeque<_>, VecDeque<_>) =
            std::mem::take(&mut self.q1).into_iter().partition(|waiting| self.needed(waiting.tile));
        self.q1 = kept;
        self.drop_waiting(dropped);
        // What is seen goes before what will be.
        self.q1.make_contiguous().sort_by_key(|waiting| !self.wanted_set.contains(&waiting.tile));
        while let Some(&Waiting { tile, slot: k2, generation }) = self.q1.front() {
            let spent = match self.config.deterministic {
                true => report.uploads >= self.config.upload_tiles_per_frame as usize,
                false => report.uploads > 0 && begin.elapsed() >= self.config.upload_budget(),
            };
            if spent {
                break;
            }
            assert!(self.j2.expects(tile, k2, generation), "{tile:?} in Q1 lost its place {k2} in J2");
            let seen = self.wanted_set.contains(&tile);
            let claim = match self.j1.claimable(if seen { now } else { self.ahead_now() }) {
                Some(claim) => claim,
                None => {
                    let (wanted, slots) = (self.wanted.len(), self.j1.capacity());
                    assert!(!seen, "{wanted} wanted tiles fill J1, of {slots} slots");
                    break;
                }
            };
            if !uploader.upload(claim.slot, tile, self.j2.bytes(k2)) {
                break;
            }
            self.q1.pop_front();
            self.place(claim, tile, report);
            self.j2.slots.touch(k2, now);
            report.uploads += 1;
            report.ahead_uploads += usize::from(!seen);
            report.upload_bytes += self.tile_bytes as u64;
        }
        // A tile fetched ahead does not wait here: its place in J2 would stay pinned as long as J1 has no room.
        let (kept, dropped): (VecDeque<_>, VecDeque<_>) = std::mem::take(&mut self.q1)
            .into_iter()
            .partition(|waiting| self.wanted_set.contains(&waiting.tile));
        self.q1 = kept;
        self.drop_waiting(dropped);
    }

    /// Tiles that leave `Q1` without having been copied: back to -2, and free to go from `J2`.
    fn drop_waiting(&mut self, dropped: VecDeque<Waiting>) {
        for waiting in dropped {
            self.h1.set(waiting.tile, ABSENT);
            self.j2.slots.touch(waiting.slot, self.wanted_now());
        }
    }

    /// A tile just uploaded takes its slot of `J1`.
    fn place(&mut self, claim: Claim, tile: TileId, report: &mut FrameReport) {
        if let Some(evicted) = claim.evicts {
            self.h1.set(evicted, ABSENT);
            self.display.push((evicted, None));
            report.gpu_evictions += 1;
        }
        self.j1.claim(claim, tile);
        self.j1.touch(claim.slot, self.wanted_now());
        self.h1.set(tile, claim.slot as i32);
        self.display.push((tile, Some(claim.slot)));
    }
}
