//! Streaming of visible tiles through two caches (paper 1, section 3), all of it on the CPU: which tile
//! is to be read, copied, replaced, and what the shader's table is to say. Another layer owns the texels
//! in video memory, behind [`Uploader`].
//!
//! As the paper has it: `J1` (N1 tiles in video memory) and `J2` (N2 in main memory), the state tables
//! `H1,q` and `H2,q`, the queues `Q1` and `Q2`, A1's table, A2 with a time budget in the frame, A3 with
//! its own in its own threads, both caches replaced least recently used first. Differs, or is decided here:
//!
//! - State and display are apart (erratum: the paper writes a coarser tile's slot into the state of a missing
//!   one). [`FrameReport::display`] lists only tiles that are in `J1`; the nearest coarser one is looked for
//!   where the table is read.
//! - A tile that gives up its slot goes back to -2, and its display cell is cleared.
//! - A visible tile in `J1` is never evicted. The visible set must then fit N1: where it does not, all its
//!   tiles are taken the fewest levels coarser with which it does ([`fitting_bias`]).
//! - `Q1` and `Q2` keep only what is wanted in this frame: the rest is dropped before A2 and A3 see it,
//!   back to -2, and asked for again if it is ever seen again. What waits in `Q1` is pinned in `J2`. Since it
//!   is wanted, A2 will take it; so a pin is short and `J2` cannot fill up with pins nobody releases.
//! - A visible tile may leave `J2` when it is in `J1`: with N2 smaller than the visible set, nothing new could
//!   be loaded otherwise. Its stamp makes it the last to go.
//! - What is shown instead of a missing tile (its nearest coarser tile in `J1`), or finer than wanted while
//!   the bias is up, gets a new time of use too, older than that of every wanted tile of the frame: it stays as
//!   long as there is anything else to evict, and is no obstacle.
//! - A load takes its place in `J2` when it is sent, and remembers the place's generation. Where the place has
//!   changed hands meanwhile ([`Streaming::reset`], or a visible tile that finds every place taken by
//!   loads nobody waits for), the load is dropped on arrival.
//! - A tile that cannot be read is reported once, and its nearest coarser tile wanted instead, until
//!   [`Streaming::forget_failures`], or for [`StreamingConfig::retry_after`].
//! - Tiles that will be seen soon may be fetched ahead ([`Streaming::frame_ahead`]): after everything that this frame
//!   sees, into places that nothing seen stands in.

mod ahead;
mod ask;
mod config;
mod host;
mod load;
mod loader;
mod lru;
pub mod replay;
mod report;
mod slots;
mod tables;
mod upload;
mod wanted;

pub use super::choices::{Keying, Order};
pub use config::{StreamingConfig, StreamingError};
pub use report::{FrameReport, TileFailure};
pub use tables::{ABSENT, Action, QUEUED, action};
pub use upload::Uploader;
pub use wanted::{distinct_tiles, fitting_bias, wanted_tiles};

use crate::math::pyramid::{Pyramid, TileId};
use crate::texture::source::TileSource;
use host::HostCache;
use load::UnderWay;
use loader::Loader;
use slots::Slots;
use std::collections::{HashSet, VecDeque};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;
use tables::StateTable;
use upload::Waiting;

/// Loads under way at most. Loads are sent in frames, so this bounds the loads of a frame too: 32 tiles of
/// 512 x 512 are 41 MiB. Cancelled ones count, and hold a buffer each until they return.
const MOST_UNDER_WAY: u32 = 32;

/// The two caches, their tables and queues, and A3's threads. One instance for a texture.
pub struct Streaming {
    config: StreamingConfig,
    pyramid: Pyramid,
    tile_bytes: usize,
    /// `H1,q` and `H2,q`.
    h1: StateTable,
    h2: StateTable,
    /// `J1` without its texels, and `J2`.
    j1: Slots,
    j2: HostCache,
    q1: VecDeque<Waiting>,
    q2: VecDeque<TileId>,
    /// A3.
    loader: Loader,
    under_way: Vec<UnderWay>,
    /// Not to be asked for now; when the retries are due, in order; and whose failure has been reported.
    failed: HashSet<TileId>,
    retries: VecDeque<(Instant, TileId)>,
    reported: HashSet<TileId>,
    frame: u64,
    requests: u64,
    /// The tiles that the latest frame wanted, in the order of its list.
    wanted: Vec<TileId>,
    wanted_set: HashSet<TileId>,
    /// The tiles that the latest frame fetched ahead.
    ahead: HashSet<TileId>,
    pending: usize,
    /// Changes of the display table that no report has carried yet.
    display: Vec<(TileId, Option<u32>)>,
}

impl Streaming {
    /// Empty caches for `source`, and the threads of A3: as many as the machine has cores where the frames wait for
    /// them, else one less; 1 to 8.
    ///
    /// # Errors
    /// [`StreamingError`]: settings with which nothing could be shown, too many tiles, or no thread.
    pub fn new(source: Arc<dyn TileSource>, config: StreamingConfig) -> Result<Self, StreamingError> {
        let pyramid = source.pyramid();
        config.check(&pyramid)?;
        let tile_bytes = source.format().tile_bytes(&pyramid);
        let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
        let (threads, capacity) = match config.deterministic {
            // The frame waits for its loads, so its core is theirs. Each load has a place in J2, and none is left
            // over from the frame before.
            true => (cores, config.load_tiles_per_frame.min(config.host_tiles)),
            false => (cores - 1, MOST_UNDER_WAY),
        };
        let loader =
            Loader::new(&source, threads.clamp(1, 8), capacity as usize).map_err(StreamingError::Thread)?;
        Ok(Self {
            pyramid,
            tile_bytes,
            h1: StateTable::new(pyramid),
            h2: StateTable::new(pyramid),
            j1: Slots::new(config.gpu_tiles),
            j2: HostCache::new(config.host_tiles, tile_bytes),
            q1: VecDeque::new(),
            q2: VecDeque::new(),
            loader,
            under_way: Vec::new(),
            failed: HashSet::new(),
            retries: VecDeque::new(),
            reported: HashSet::new(),
            frame: 0,
            requests: 0,
            wanted: Vec::new(),
            wanted_set: HashSet::new(),
            ahead: HashSet::new(),
            pending: 0,
            display: Vec::new(),
            config,
        })
    }

    /// One frame: adopts what A3 has loaded, does A1 for `visible` in its order, A2, and hands A3 its work.
    /// `visible`: tiles of streamed levels; repeats do no harm ([`distinct_tiles`] removes them).
    pub fn frame(&mut self, visible: &[TileId], uploader: &mut dyn Uploader) -> FrameReport {
        self.frame_ahead(visible, &[], uploader)
    }

    /// [`Streaming::frame`], and what time and room are left go to the tiles of `ahead`, which are not visible yet.
    pub fn frame_ahead(
        &mut self,
        visible: &[TileId],
        ahead: &[TileId],
        uploader: &mut dyn Uploader,
    ) -> FrameReport {
        self.frame += 1;
        let mut report = FrameReport { frame: self.frame, triples: visible.len(), ..Default::default() };
        self.adopt(&mut report);
        self.choose(visible, &mut report);
        self.ask_ahead(ahead, &mut report);
        self.ask(visible, &mut report);
        self.upload(uploader, &mut report);
        self.dispatch(&mut report);
        self.pending = self.wanted.iter().filter(|&&tile| self.h1.get(tile) < 0).count();
        report.pending = self.pending;
        report.failed_tiles = self.failed.len();
        report.queued_uploads = self.q1.len();
        report.queued_loads = self.q2.len();
        report.loads_under_way = self.loader.under_way();
        report.display = std::mem::take(&mut self.display);
        report
    }

    /// Whether every tile wanted by the latest frame is in `J1`. (Tiles that failed are not wanted; what
    /// replaces them is.) True before the first frame.
    pub fn settled(&self) -> bool {
        self.pending == 0
    }

    /// Unreadable tiles are asked for again when they are next seen.
    pub fn forget_failures(&mut self) {
        self.failed.clear();
        self.retries.clear();
        self.reported.clear();
    }

    /// Empties both caches and queues, as for a texture whose tiles have changed. Loads under way do not land.
    /// The next report clears the display table. Failures are kept.
    pub fn reset(&mut self) {
        for load in self.under_way.drain(..) {
            load.cancelled.store(true, Ordering::Relaxed);
        }
        self.q1.clear();
        self.q2.clear();
        for (tile, k1) in self.h1.present().collect::<Vec<_>>() {
            if k1 >= 0 {
                self.j1.release(k1 as u32);
                self.display.push((tile, None));
            }
            self.h1.set(tile, ABSENT);
        }
        for (tile, _) in self.h2.present().collect::<Vec<_>>() {
            self.h2.set(tile, ABSENT);
        }
        for slot in 0..self.j2.slots.capacity() {
            if self.j2.slots.tile(slot).is_some() {
                self.j2.release(slot);
            }
        }
        self.pending = self.wanted.len();
    }

    /// The settings given to [`Streaming::new`].
    pub fn config(&self) -> &StreamingConfig {
        &self.config
    }

    /// Tiles that the latest frame wanted, in the order of its list.
    pub fn wanted(&self) -> &[TileId] {
        &self.wanted
    }

    /// k1 and k2 of a tile: its cells of `H1,q` and `H2,q`.
    pub fn state(&self, tile: TileId) -> (i32, i32) {
        (self.h1.get(tile), self.h2.get(tile))
    }

    /// The tile in slot `slot < N1` of `J1`.
    pub fn gpu_tile(&self, slot: u32) -> Option<TileId> {
        self.j1.tile(slot)
    }

    /// How many tiles slot `slot < N1` of `J1` has held.
    pub fn gpu_generation(&self, slot: u32) -> u64 {
        self.j1.generation(slot)
    }

    /// The tile in place `slot < N2` of `J2`, or the one being loaded into it.
    pub fn host_tile(&self, slot: u32) -> Option<TileId> {
        self.j2.slots.tile(slot)
    }

    /// Time of use of tiles that are fetched ahead, of those that are shown without being wanted, and of those that
    /// are wanted.
    fn ahead_now(&self) -> u64 {
        3 * self.frame
    }
    fn shown_now(&self) -> u64 {
        3 * self.frame + 1
    }
    fn wanted_now(&self) -> u64 {
        3 * self.frame + 2
    }
}
