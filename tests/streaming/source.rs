//! A texture whose reads can be delayed, blocked and broken, and video memory that records its bytes.

use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::paper::virtual_texture::streaming::{
    Order, Streaming, StreamingConfig, StreamingCounts, Uploader,
};
use ortelius::texture::source::{TileError, TileFormat, TileSource};
use std::collections::{HashMap, HashSet};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

/// 512 x 256 texels in tiles of 16: level 0 has 32 x 16 tiles, level 4 has 2 x 1, levels from 5 are resident.
pub fn pyramid() -> Pyramid {
    Pyramid::new(9, 8, 4, 2, None).unwrap()
}

pub fn tile(level: u32, row: u32, column: u32) -> TileId {
    TileId { level, row, column }
}

/// `rows x columns` tiles of level 0 from the north-west corner.
pub fn block(rows: u32, columns: u32) -> Vec<TileId> {
    (0..rows).flat_map(|row| (0..columns).map(move |column| tile(0, row, column))).collect()
}

#[derive(Default)]
struct Behaviour {
    broken: HashSet<TileId>,
    shut: bool,
    reads: Vec<TileId>,
}

#[derive(Default)]
pub struct TestSource {
    behaviour: Mutex<Behaviour>,
    changed: Condvar,
    /// Sleep before a tile is read.
    pub delay: Option<fn(TileId) -> Duration>,
}

impl TestSource {
    pub fn with_delay(delay: fn(TileId) -> Duration) -> Self {
        Self { delay: Some(delay), ..Self::default() }
    }

    pub fn set_broken(&self, tiles: impl IntoIterator<Item = TileId>) {
        self.behaviour.lock().unwrap().broken = tiles.into_iter().collect();
    }

    /// While the gate is shut, every read waits.
    pub fn set_gate(&self, shut: bool) {
        self.behaviour.lock().unwrap().shut = shut;
        self.changed.notify_all();
    }

    /// Tiles read so far, in the order in which the reads began.
    pub fn reads(&self) -> Vec<TileId> {
        self.behaviour.lock().unwrap().reads.clone()
    }

    /// The correct bytes of a tile.
    pub fn bytes(tile: TileId) -> Vec<u8> {
        let name = [tile.level as u8, tile.row as u8, tile.column as u8, 0xA5];
        name.into_iter().cycle().take(TileFormat::Rgba8.tile_bytes(&pyramid())).collect()
    }
}

impl TileSource for TestSource {
    fn describe(&self) -> String {
        "test".to_owned()
    }

    fn pyramid(&self) -> Pyramid {
        pyramid()
    }

    fn format(&self) -> TileFormat {
        TileFormat::Rgba8
    }

    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        if let Some(delay) = self.delay {
            std::thread::sleep(delay(tile));
        }
        let mut behaviour = self.behaviour.lock().unwrap();
        behaviour.reads.push(tile);
        let behaviour = self.changed.wait_while(behaviour, |behaviour| behaviour.shut).unwrap();
        if behaviour.broken.contains(&tile) {
            bytes.fill(0xEE);
            return Err(TileError::Refused { tile, reason: "broken on purpose".to_owned() });
        }
        bytes.copy_from_slice(&Self::bytes(tile));
        Ok(())
    }

    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        unreachable!("streaming never reads the resident level {level}")
    }
}

/// The tile pool's texels and the page table, maintained as a driver would: only from uploads and reported
/// changes.
#[derive(Default)]
pub struct VideoMemory {
    pub slots: HashMap<u32, Vec<u8>>,
    pub display: HashMap<TileId, u32>,
    /// Number of uploads still accepted; then there is no room.
    pub room: Option<usize>,
    /// Sleep in every upload.
    pub delay: Duration,
}

impl Uploader for VideoMemory {
    fn upload(&mut self, slot: u32, _: TileId, bytes: &[u8]) -> bool {
        if let Some(room) = &mut self.room {
            if *room == 0 {
                return false;
            }
            *room -= 1;
        }
        std::thread::sleep(self.delay);
        self.slots.insert(slot, bytes.to_vec());
        true
    }
}

impl VideoMemory {
    pub fn apply(&mut self, report: &StreamingCounts) {
        for &(tile, slot) in &report.display {
            match slot {
                Some(slot) => self.display.insert(tile, slot),
                None => self.display.remove(&tile),
            };
        }
    }
}

/// Streaming from a test source into a test memory; every frame is checked.
pub struct Bench {
    pub source: Arc<TestSource>,
    pub memory: VideoMemory,
    pub streaming: Streaming,
}

impl Bench {
    pub fn new(source: TestSource, config: StreamingConfig) -> Self {
        let source = Arc::new(source);
        let streaming = Streaming::new(source.clone(), config).unwrap();
        Self { source, memory: VideoMemory::default(), streaming }
    }

    pub fn frame(&mut self, visible: &[TileId]) -> StreamingCounts {
        self.frame_ahead(visible, &[])
    }

    pub fn frame_ahead(&mut self, visible: &[TileId], expected: &[TileId]) -> StreamingCounts {
        let report = self.streaming.frame_ahead(visible, expected, &mut self.memory);
        self.memory.apply(&report);
        crate::invariants::check(&self.streaming, &self.memory, &report).unwrap();
        report
    }

    /// Frames until settled, at most `max`.
    ///
    /// # Panics
    /// Without deterministic loads: their frames depend on threads, so use [`Bench::settle_timed`].
    pub fn settle(&mut self, visible: &[TileId], max: usize) -> Vec<StreamingCounts> {
        assert!(self.streaming.config().deterministic);
        let mut reports = Vec::new();
        while reports.len() < max {
            reports.push(self.frame(visible));
            if self.streaming.settled() {
                return reports;
            }
        }
        panic!("not settled after {max} frames: {:?}", reports.last());
    }

    /// Frames until settled, however many: a starved loader thread needs any number of them.
    pub fn settle_timed(&mut self, visible: &[TileId]) -> Vec<StreamingCounts> {
        self.until(visible, |bench, _| bench.streaming.settled())
    }

    /// Frames until `done` holds after one.
    pub fn until(
        &mut self,
        visible: &[TileId],
        mut done: impl FnMut(&Self, &StreamingCounts) -> bool,
    ) -> Vec<StreamingCounts> {
        let mut reports = Vec::new();
        loop {
            let report = self.frame(visible);
            let is_done = done(self, &report);
            reports.push(report);
            if is_done {
                return reports;
            }
            std::thread::sleep(Duration::from_micros(200));
        }
    }
}

/// Budgets in tiles.
pub fn counting(gpu_tiles: u32, host_tiles: u32, uploads: u32, loads: u32) -> StreamingConfig {
    StreamingConfig {
        gpu_tiles,
        host_tiles,
        upload_tiles_per_frame: uploads,
        load_tiles_per_frame: loads,
        deterministic: true,
        order: Order::Finest,
        retry_after_ms: 0.0,
        ..StreamingConfig::default()
    }
}

/// Budgets in time, too long to have an effect.
pub fn timed(gpu_tiles: u32, host_tiles: u32) -> StreamingConfig {
    StreamingConfig {
        gpu_tiles,
        host_tiles,
        upload_budget_ms: 1e12,
        load_budget_ms: 1e12,
        order: Order::Finest,
        retry_after_ms: 0.0,
        ..StreamingConfig::default()
    }
}
