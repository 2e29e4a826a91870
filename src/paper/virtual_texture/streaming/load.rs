//! Loading, on the frame's thread (paper 1, section 3): sends requests to the loader threads and takes their results.

use super::loader::{FinishedLoad, LoadFailure, Request};
use super::slots::AvailableSlot;
use super::tables::{ABSENT, QUEUED};
use super::upload::Waiting;
use super::{Streaming, StreamingCounts, TileFailure};
use crate::math::pyramid::TileId;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A load that was sent to the loader and has not returned.
pub(super) struct UnderWay {
    pub tile: TileId,
    pub slot: u32,
    pub generation: u64,
    pub cancelled: Arc<AtomicBool>,
}

impl Streaming {
    /// Takes the loader's results: stores the tile's host slot and appends the tile to the upload queue, or records the
    /// failure.
    pub(super) fn adopt(&mut self, report: &mut StreamingCounts) {
        while self.retries.front().is_some_and(|(due, _)| *due <= Instant::now()) {
            let (_, tile) = self.retries.pop_front().expect("just seen");
            self.failed.remove(&tile);
        }
        if self.config.deterministic {
            for loaded in self.loader.receive_all() {
                self.adopt_one(loaded, report);
            }
        } else {
            while let Some(loaded) = self.loader.try_receive() {
                self.adopt_one(loaded, report);
            }
        }
    }

    fn adopt_one(&mut self, FinishedLoad { request, outcome }: FinishedLoad, report: &mut StreamingCounts) {
        let Request { tile, slot, generation, bytes, .. } = request;
        if !self.host_cache.expects(tile, slot, generation) {
            report.stale_loads += 1;
            self.host_cache.recycle(bytes);
            return;
        }
        self.under_way.retain(|load| (load.slot, load.generation) != (slot, generation));
        match outcome {
            Ok(()) => {
                report.loads += 1;
                if self.reported.remove(&tile) {
                    tracing::debug!("{tile} can be read again");
                }
                self.host_cache.fill(slot, bytes);
                self.host_states.set(tile, slot as i32);
                self.gpu_states.set(tile, QUEUED);
                self.upload_queue.push_back(Waiting { tile, slot, generation });
            }
            Err(failure) => {
                let LoadFailure::Source(error) = failure else {
                    panic!("{tile:?} was cancelled, but still has slot {slot} of the host cache");
                };
                self.host_cache.recycle(bytes);
                self.host_cache.release(slot);
                self.host_states.set(tile, ABSENT);
                self.failed.insert(tile);
                if !self.config.retry_after().is_zero() && !self.config.deterministic {
                    self.retries.push_back((Instant::now() + self.config.retry_after(), tile));
                }
                if self.reported.insert(tile) {
                    tracing::warn!("{error}; its nearest coarser tile is shown instead");
                    report.failures.push(TileFailure { tile, reason: error.to_string() });
                }
            }
        }
    }

    /// Sends the queued tiles that this frame needs to the loader, while the loader and the host cache have room.
    pub(super) fn dispatch(&mut self, report: &mut StreamingCounts) {
        let (kept, dropped): (VecDeque<_>, VecDeque<_>) =
            std::mem::take(&mut self.load_queue).into_iter().partition(|&tile| self.needed(tile));
        self.load_queue = kept;
        self.load_queue.make_contiguous().sort_by_key(|tile| !self.wanted_set.contains(tile));
        for tile in dropped {
            self.host_states.set(tile, ABSENT);
        }
        while self.loader.has_room()
            && let Some(&tile) = self.load_queue.front()
        {
            let claim = match self.wanted_set.contains(&tile) {
                true => self.host_claim(),
                false => self.host_claim_for_prefetch(),
            };
            let Some(claim) = claim else { break };
            self.load_queue.pop_front();
            // A slot taken from a cancelled load evicts no tile.
            if let Some(evicted) = claim.evicts {
                self.host_states.set(evicted, ABSENT);
                report.host_evictions += 1;
            }
            let (generation, bytes) = self.host_cache.claim(claim, tile);
            let cancelled = Arc::new(AtomicBool::new(false));
            let load = UnderWay { tile, slot: claim.slot, generation, cancelled: Arc::clone(&cancelled) };
            self.under_way.push(load);
            self.requests += 1;
            let sequence = self.requests;
            self.loader.send(Request { tile, slot: claim.slot, generation, sequence, bytes, cancelled });
        }
        let unlimited = self.config.deterministic || self.lifted;
        self.loader.grant(if unlimited { Duration::MAX } else { self.config.load_budget() });
    }

    /// A slot of the host cache for a load. If all slots are pinned, a load is cancelled to free its slot: the latest
    /// load whose tile the frame does not want. A prefetched tile counts as not wanted. The latest load is the least
    /// likely to have begun.
    fn host_claim(&mut self) -> Option<AvailableSlot> {
        if let Some(claim) = self.host_cache.slots.claimable(u64::MAX) {
            return Some(claim);
        }
        let idle = self.under_way.iter().rposition(|load| !self.wanted_set.contains(&load.tile))?;
        let load = self.under_way.remove(idle);
        load.cancelled.store(true, Ordering::Relaxed);
        self.host_cache.release(load.slot);
        self.host_states.set(load.tile, ABSENT);
        self.host_cache.slots.claimable(u64::MAX)
    }
}
