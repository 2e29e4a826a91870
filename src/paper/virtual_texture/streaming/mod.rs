//! Streaming of visible tiles through two caches (paper 1, section 3), entirely on the CPU. This module decides which
//! tiles to read, upload and evict, and which changes the page table gets. [`Uploader`] writes the texels in video
//! memory.
//!
//! As in the paper, the tile pool holds N1 tiles in video memory and the host cache N2 tiles in main memory. Both
//! caches evict the least recently used tile. The update changes the states of the wanted tiles. The upload step
//! empties the upload queue within the frame's time budget. The loader empties the load queue in its own threads,
//! within its own budget. The module [`super`] has a table of the paper's letters. Differences, and decisions that the
//! paper leaves open:
//!
//! - States and page table are separate (erratum: the paper writes a coarser tile's slot into the state of a missing
//!   tile). [`StreamingCounts::display`] lists the tiles that enter or leave the tile pool; the page table finds the
//!   nearest coarser tile of each missing tile.
//! - A tile that loses its slot returns to state -2 (absent), and its cell of the page table is cleared.
//! - A visible tile in the tile pool is never evicted, so the visible set must fit into N1 slots. If it does not fit,
//!   all tiles are requested coarser, by the smallest number of levels that fits ([`fitting_bias`]). In a moving
//!   picture this bias rises at once and falls late ([`LevelBias`]), so that the picture does not flicker.
//! - The queues hold only tiles that this frame needs. All other queued tiles return to state -2 before the upload
//!   step and the loader run, and are requested again when they are seen again. A tile in the upload queue is
//!   pinned in the host cache until it is uploaded or dropped from the queue.
//! - A visible tile may leave the host cache once it is in the tile pool. Otherwise nothing new could be loaded if N2
//!   is smaller than the visible set. Visible tiles have the latest time of use, so they are evicted last.
//! - A tile can be shown without being wanted: the nearest coarser tile of a missing one, or a finer one while the bias
//!   is raised. Such a tile's time of use is also updated, but to an earlier time than that of the wanted tiles. It is
//!   evicted after all tiles that are not shown, and before the wanted tiles.
//! - A load reserves its slot of the host cache when it is sent, and stores the slot's generation. A load whose slot
//!   has been reassigned is dropped on arrival. [`Streaming::reset`] reassigns slots. If loads have reserved all slots,
//!   a visible tile takes the slot of a load that is no longer wanted.
//! - A tile that cannot be read is reported once. Its nearest coarser tile is wanted instead, for the time
//!   [`StreamingConfig::retry_after`].
//! - Tiles that are expected soon can be prefetched ([`Streaming::frame_ahead`]), after all tiles of this frame and
//!   into slots without a visible tile. Their time of use is older than that of this frame's tiles, so wrongly
//!   predicted ones are evicted first.

mod config;
mod host;
mod load;
mod loader;
mod lru;
mod prefetch;
pub mod replay;
mod report;
mod slots;
mod tables;
mod update;
mod upload;
mod wanted;

pub use super::choices::{Order, TileAddress};
pub use config::{StreamingConfig, StreamingError};
pub use report::{StreamingCounts, TileFailure};
pub use tables::{ABSENT, QUEUED, TileAction, action};
pub use upload::Uploader;
pub use wanted::{LOWER_AFTER, LevelBias, distinct_tiles, fitting_bias, wanted_tiles};

use crate::math::pyramid::{Pyramid, TileId};
use crate::texture::source::TileSource;
use host::HostCache;
use load::UnderWay;
use loader::Loader;
use slots::Slots;
use std::collections::{HashSet, VecDeque};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use tables::StateTable;
use upload::Waiting;

/// Maximum number of loads under way. Loads are sent once per frame, so a frame receives at most this many loads. 32
/// tiles of 512 x 512 texels are 41 MiB. Cancelled loads count, because each holds a buffer until it returns.
const MAX_UNDER_WAY: u32 = 32;

/// The two caches, their state tables and queues, and the loader. One instance per texture.
pub struct Streaming {
    config: StreamingConfig,
    pyramid: Pyramid,
    tile_bytes: usize,
    /// States of the tiles in the tile pool and in the host cache.
    gpu_states: StateTable,
    host_states: StateTable,
    /// Slots of the tile pool, without the texels.
    tile_pool: Slots,
    host_cache: HostCache,
    upload_queue: VecDeque<Waiting>,
    load_queue: VecDeque<TileId>,
    loader: Loader,
    under_way: Vec<UnderWay>,
    /// Tiles that are not requested now, because they could not be read.
    failed: HashSet<TileId>,
    /// When failed tiles are requested again, in order of time.
    retries: VecDeque<(Instant, TileId)>,
    /// Tiles whose failure has been reported.
    reported: HashSet<TileId>,
    frame: u64,
    requests: u64,
    /// The tiles that the latest frame wanted, in the order of its list.
    wanted: Vec<TileId>,
    wanted_set: HashSet<TileId>,
    /// The tiles that the latest frame prefetched.
    expected: HashSet<TileId>,
    pending: usize,
    bias: LevelBias,
    /// True if the latest frame's bias is higher than its tiles need.
    bias_held: bool,
    /// True if time does not limit loads and uploads.
    lifted: bool,
    /// Frames in a row with lifted budgets.
    frames_at_rest: u32,
    /// Changes of the page table since the last report.
    page_table_changes: Vec<(TileId, Option<u32>)>,
}

impl Streaming {
    /// Creates empty caches for `source`, and 1 to 8 loader threads. If frames wait for their loads, there is one
    /// thread for each core of the machine, otherwise one thread less.
    ///
    /// # Errors
    /// [`StreamingError`]: settings with which no tile could be shown, too many tiles, or a thread that cannot be
    /// created.
    pub fn new(source: Arc<dyn TileSource>, config: StreamingConfig) -> Result<Self, StreamingError> {
        let pyramid = source.pyramid();
        config.check(&pyramid)?;
        let tile_bytes = source.format().tile_bytes(&pyramid);
        let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
        let (threads, capacity) = match config.deterministic {
            // The frame waits for its loads, so its core is free for them. Each load needs a slot of the host cache,
            // and no load is left from the previous frame.
            true => (cores, config.load_tiles_per_frame.min(config.host_tiles)),
            false => (cores - 1, MAX_UNDER_WAY),
        };
        let loader =
            Loader::new(&source, threads.clamp(1, 8), capacity as usize).map_err(StreamingError::Thread)?;
        Ok(Self {
            pyramid,
            tile_bytes,
            gpu_states: StateTable::new(pyramid),
            host_states: StateTable::new(pyramid),
            tile_pool: Slots::new(config.gpu_tiles),
            host_cache: HostCache::new(config.host_tiles, tile_bytes),
            upload_queue: VecDeque::new(),
            load_queue: VecDeque::new(),
            loader,
            under_way: Vec::new(),
            failed: HashSet::new(),
            retries: VecDeque::new(),
            reported: HashSet::new(),
            frame: 0,
            requests: 0,
            wanted: Vec::new(),
            wanted_set: HashSet::new(),
            expected: HashSet::new(),
            pending: 0,
            bias: LevelBias::default(),
            bias_held: false,
            lifted: false,
            frames_at_rest: 0,
            page_table_changes: Vec::new(),
            config,
        })
    }

    /// Runs one frame: takes the finished loads, updates the states of `visible` in its order, uploads, and sends new
    /// loads. `visible` holds tiles of streamed levels; repeats are allowed ([`distinct_tiles`] removes them).
    pub fn frame(&mut self, visible: &[TileId], uploader: &mut dyn Uploader) -> StreamingCounts {
        self.frame_ahead(visible, &[], uploader)
    }

    /// As [`Streaming::frame`]; the remaining budget and slots go to the tiles of `expected`, which are not visible
    /// yet.
    pub fn frame_ahead(
        &mut self,
        visible: &[TileId],
        expected: &[TileId],
        uploader: &mut dyn Uploader,
    ) -> StreamingCounts {
        self.frame += 1;
        let mut report = StreamingCounts { frame: self.frame, triples: visible.len(), ..Default::default() };
        self.adopt(&mut report);
        self.choose(visible, &mut report);
        self.prefetch(expected, &mut report);
        self.update(visible, &mut report);
        self.upload(uploader, &mut report);
        self.dispatch(&mut report);
        self.pending = self.wanted.iter().filter(|&&tile| self.gpu_states.get(tile) < 0).count();
        report.pending = self.pending;
        report.failed_tiles = self.failed.len();
        report.queued_uploads = self.upload_queue.len();
        report.queued_loads = self.load_queue.len();
        report.loads_under_way = self.loader.under_way();
        report.display = std::mem::take(&mut self.page_table_changes);
        report
    }

    /// True if every tile that the latest frame wanted is in the tile pool, at the smallest bias that fits; also true
    /// before the first frame. Failed tiles are not wanted, but their substitutes are.
    pub fn settled(&self) -> bool {
        self.pending == 0 && !self.bias_held
    }

    /// Lifts or restores the time budgets, for a camera at rest. The capacity of staging memory and of the queues still
    /// limits a frame.
    pub fn lift_budgets(&mut self, lifted: bool) {
        if std::mem::replace(&mut self.lifted, lifted) && !lifted {
            // Takes back an unlimited grant.
            self.loader.grant(Duration::ZERO);
        }
    }

    /// Empties both caches and queues, for a texture whose tiles have changed. Loads under way are dropped. The next
    /// report clears the page table. Failures are kept.
    pub fn reset(&mut self) {
        for load in self.under_way.drain(..) {
            load.cancelled.store(true, Ordering::Relaxed);
        }
        self.upload_queue.clear();
        self.load_queue.clear();
        for (tile, gpu_state) in self.gpu_states.present().collect::<Vec<_>>() {
            if gpu_state >= 0 {
                self.tile_pool.release(gpu_state as u32);
                self.page_table_changes.push((tile, None));
            }
            self.gpu_states.set(tile, ABSENT);
        }
        for (tile, _) in self.host_states.present().collect::<Vec<_>>() {
            self.host_states.set(tile, ABSENT);
        }
        for slot in 0..self.host_cache.slots.capacity() {
            if self.host_cache.slots.tile(slot).is_some() {
                self.host_cache.release(slot);
            }
        }
        self.pending = self.wanted.len();
    }

    /// Changes the settings from the next frame on. The host cache keeps its most recently used tiles. If `gpu_tiles`
    /// changes, an empty tile pool replaces the old one, and tiles are uploaded again from the host cache.
    ///
    /// # Errors
    /// As [`Streaming::new`]; nothing has changed then.
    ///
    /// # Panics
    /// If `deterministic` changes; or, with budgets that count tiles, if the maximum number of loads per frame changes.
    pub fn reconfigure(&mut self, config: StreamingConfig) -> Result<(), StreamingError> {
        config.check(&self.pyramid)?;
        assert!(self.config.same_loader(&config), "the loader is for {:?}, not {config:?}", self.config);
        if config.gpu_tiles != self.config.gpu_tiles {
            for (tile, gpu_state) in self.gpu_states.present().collect::<Vec<_>>() {
                if gpu_state >= 0 {
                    self.gpu_states.set(tile, ABSENT);
                }
            }
            self.tile_pool = Slots::new(config.gpu_tiles);
            self.page_table_changes.clear();
            self.pending = self.wanted.len();
        }
        if config.host_tiles != self.config.host_tiles {
            self.resize_host_cache(config.host_tiles);
        }
        if (config.gpu_tiles, config.level_bias) != (self.config.gpu_tiles, self.config.level_bias) {
            self.bias = LevelBias::default();
        }
        self.config = config;
        Ok(())
    }

    /// Resizes the host cache. Tiles that wait for their upload are requested again; loads under way are dropped.
    fn resize_host_cache(&mut self, capacity: u32) {
        for load in self.under_way.drain(..) {
            load.cancelled.store(true, Ordering::Relaxed);
            self.host_states.set(load.tile, ABSENT);
        }
        for waiting in self.upload_queue.drain(..) {
            self.gpu_states.set(waiting.tile, ABSENT);
        }
        let before = std::mem::replace(&mut self.host_cache, HostCache::new(0, self.tile_bytes));
        let (host_cache, moved) = before.resized(capacity);
        self.host_cache = host_cache;
        for (tile, slot) in moved {
            self.host_states.set(tile, ABSENT);
            if let Some(slot) = slot {
                self.host_states.set(tile, QUEUED);
                self.host_states.set(tile, slot as i32);
            }
        }
    }

    /// The current settings.
    pub fn config(&self) -> &StreamingConfig {
        &self.config
    }

    /// Tiles that the latest frame wanted, in the order of its list.
    pub fn wanted(&self) -> &[TileId] {
        &self.wanted
    }

    /// The states of a tile in the tile pool and in the host cache.
    pub fn state(&self, tile: TileId) -> (i32, i32) {
        (self.gpu_states.get(tile), self.host_states.get(tile))
    }

    /// The tile in slot `slot < N1` of the tile pool.
    pub fn gpu_tile(&self, slot: u32) -> Option<TileId> {
        self.tile_pool.tile(slot)
    }

    /// The number of tiles that the tile pool's slot `slot` (below N1) has held so far.
    pub fn gpu_generation(&self, slot: u32) -> u64 {
        self.tile_pool.generation(slot)
    }

    /// The tile in slot `slot < N2` of the host cache, or the one being loaded into it.
    pub fn host_tile(&self, slot: u32) -> Option<TileId> {
        self.host_cache.slots.tile(slot)
    }

    /// Frames since the tile in this slot of the tile pool was used; `None` if the slot is free.
    pub fn gpu_age(&self, slot: u32) -> Option<u64> {
        self.tile_pool.last_use(slot).map(|time| self.frame - time / 3)
    }

    /// As [`Streaming::gpu_age`], for the host cache; also `None` if the slot is pinned.
    pub fn host_age(&self, slot: u32) -> Option<u64> {
        self.host_cache.slots.last_use(slot).map(|time| self.frame - time / 3)
    }

    /// Time of use of prefetched tiles, and of loaded tiles that this frame does not show.
    fn prefetch_time(&self) -> u64 {
        3 * self.frame
    }
    /// Time of use of tiles that are shown without being wanted.
    fn shown_time(&self) -> u64 {
        3 * self.frame + 1
    }
    /// Time of use of wanted tiles.
    fn wanted_time(&self) -> u64 {
        3 * self.frame + 2
    }
}
