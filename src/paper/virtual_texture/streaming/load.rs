//! A3 as the frame sees it: what its threads are given, and what comes back (paper 1, section 3).

use super::loader::{LoadFailure, Loaded, Request};
use super::slots::Claim;
use super::tables::{ABSENT, QUEUED};
use super::upload::Waiting;
use super::{FrameReport, Streaming, TileFailure};
use crate::math::pyramid::TileId;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A load that a thread has, or will have.
pub(super) struct UnderWay {
    pub tile: TileId,
    pub slot: u32,
    pub generation: u64,
    pub cancelled: Arc<AtomicBool>,
}

impl Streaming {
    /// The results of A3: correct k2, append to `Q1`, k1 := -1; or note the failure.
    pub(super) fn adopt(&mut self, report: &mut FrameReport) {
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

    fn adopt_one(&mut self, Loaded { request, outcome }: Loaded, report: &mut FrameReport) {
        let Request { tile, slot, generation, bytes, .. } = request;
        if !self.j2.expects(tile, slot, generation) {
            report.stale_loads += 1;
            self.j2.recycle(bytes);
            return;
        }
        self.under_way.retain(|load| (load.slot, load.generation) != (slot, generation));
        match outcome {
            Ok(()) => {
                report.loads += 1;
                if self.reported.remove(&tile) {
                    tracing::debug!("{tile} can be read again");
                }
                self.j2.fill(slot, bytes);
                self.h2.set(tile, slot as i32);
                self.h1.set(tile, QUEUED);
                self.q1.push_back(Waiting { tile, slot, generation });
            }
            Err(failure) => {
                let LoadFailure::Source(error) = failure else {
                    panic!("{tile:?} was cancelled, but still has its place {slot} in J2");
                };
                self.j2.recycle(bytes);
                self.j2.release(slot);
                self.h2.set(tile, ABSENT);
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

    /// Hands A3 its work: what `Q2` holds and this frame wants, as far as `J2` has places.
    pub(super) fn dispatch(&mut self, report: &mut FrameReport) {
        let (kept, dropped): (VecDeque<_>, VecDeque<_>) =
            std::mem::take(&mut self.q2).into_iter().partition(|&tile| self.needed(tile));
        self.q2 = kept;
        self.q2.make_contiguous().sort_by_key(|tile| !self.wanted_set.contains(tile));
        for tile in dropped {
            self.h2.set(tile, ABSENT);
        }
        while self.loader.has_room()
            && let Some(&tile) = self.q2.front()
        {
            let claim = match self.wanted_set.contains(&tile) {
                true => self.host_claim(),
                false => self.host_claim_ahead(),
            };
            let Some(claim) = claim else { break };
            self.q2.pop_front();
            // A place taken from a load under way held no tile yet.
            if let Some(evicted) = claim.evicts {
                self.h2.set(evicted, ABSENT);
                report.host_evictions += 1;
            }
            let (generation, bytes) = self.j2.claim(claim, tile);
            let cancelled = Arc::new(AtomicBool::new(false));
            let load = UnderWay { tile, slot: claim.slot, generation, cancelled: Arc::clone(&cancelled) };
            self.under_way.push(load);
            self.requests += 1;
            let sequence = self.requests;
            self.loader.send(Request { tile, slot: claim.slot, generation, sequence, bytes, cancelled });
        }
        let unlimited = Duration::MAX;
        self.loader.grant(if self.config.deterministic { unlimited } else { self.config.load_budget() });
    }

    /// A place in `J2` for a load. Where all are pinned, a load under way that nobody waits for any more loses
    /// its own: the latest, because it is the least likely to have begun.
    fn host_claim(&mut self) -> Option<Claim> {
        if let Some(claim) = self.j2.slots.claimable(u64::MAX) {
            return Some(claim);
        }
        let idle = self.under_way.iter().rposition(|load| !self.wanted_set.contains(&load.tile))?;
        let load = self.under_way.remove(idle);
        load.cancelled.store(true, Ordering::Relaxed);
        self.j2.release(load.slot);
        self.h2.set(load.tile, ABSENT);
        self.j2.slots.claimable(u64::MAX)
    }
}
