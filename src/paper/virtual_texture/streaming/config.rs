//! Sizes and budgets of the two caches.

use crate::math::pyramid::Pyramid;
use std::time::Duration;
use thiserror::Error;

/// Settings of [`Streaming`](super::Streaming).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StreamingConfig {
    /// N1: tiles in video memory.
    pub gpu_tiles: u32,
    /// N2: tiles in main memory.
    pub host_tiles: u32,
    /// Time of A2 in a frame. A tile begun is finished, so at least one is uploaded.
    pub upload_budget: Duration,
    /// Time of A3's threads in a frame, added up. A load longer than it is paid from later frames' grants.
    pub load_budget: Duration,
    /// A2's budget in tiles, where `deterministic`; in any mode the most that a frame's staging memory holds.
    pub upload_tiles_per_frame: u32,
    /// A3's budget in tiles, where `deterministic`.
    pub load_tiles_per_frame: u32,
    /// Budgets count tiles instead of time, each frame waits for the loads that the frame before asked for,
    /// and adopts them in the order of asking: the same lists give the same frames on any machine.
    pub deterministic: bool,
    /// Levels added to every visible tile's.
    pub level_bias: u32,
    /// Which of the missing tiles is asked for first.
    pub order: Order,
    /// A tile that could not be read is asked for again after this time. Zero, or `deterministic`: never.
    pub retry_after: Duration,
}

/// In which order a frame's missing tiles are asked for; the paper leaves it to the device's list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Order {
    /// As listed: from the finest level to the coarsest.
    Finest,
    /// From the coarsest level to the finest: what covers most of the texture comes first.
    Coarsest,
}

impl Default for StreamingConfig {
    /// Ours; the paper chooses N1 by experiment and names no budget. 256 tiles are 2.5 times the most that a
    /// frame of 1920 x 1080 usually shows (30 to 100 of 512 x 512 texels).
    fn default() -> Self {
        Self {
            gpu_tiles: 256,
            host_tiles: 512,
            upload_budget: Duration::from_millis(4),
            load_budget: Duration::from_millis(16),
            upload_tiles_per_frame: 16,
            load_tiles_per_frame: 16,
            deterministic: false,
            level_bias: 0,
            order: Order::Finest,
            retry_after: Duration::ZERO,
        }
    }
}

/// Settings with which no tile could ever be shown, or a system that gives no threads.
#[derive(Debug, Error)]
pub enum StreamingError {
    #[error("{setting} = {value}: must be 1 ..= {most}")]
    OutOfRange { setting: &'static str, value: u32, most: u32 },
    #[error("{setting} = 0: nothing would ever be loaded; give it a time above 0")]
    NoTime { setting: &'static str },
    #[error("a texture of {tiles} tiles is beyond the {most} that the state tables hold; take larger tiles")]
    TooManyTiles { tiles: u64, most: u64 },
    #[error("no thread to load tiles with: {0}; raise the limit of processes (ulimit -u)")]
    Thread(std::io::Error),
}

/// Two tables of 4 bytes a tile: 512 MiB together. 2^20 x 2^20 texels in tiles of 128 just do not fit,
/// in tiles of 256 they take a quarter.
pub const MOST_TILES: u64 = 1 << 26;

impl StreamingConfig {
    pub(super) fn check(&self, pyramid: &Pyramid) -> Result<(), StreamingError> {
        let mut counts = vec![
            ("gpu_tiles", self.gpu_tiles),
            ("host_tiles", self.host_tiles),
            // In any mode: it is also how many tiles a frame's staging memory holds.
            ("upload_tiles_per_frame", self.upload_tiles_per_frame),
        ];
        if self.deterministic {
            counts.push(("load_tiles_per_frame", self.load_tiles_per_frame));
        } else {
            let times = [("upload_budget", self.upload_budget), ("load_budget", self.load_budget)];
            if let Some(&(setting, _)) = times.iter().find(|(_, time)| time.is_zero()) {
                return Err(StreamingError::NoTime { setting });
            }
        }
        // A slot's index is an i32 in the tables; 2^20 slots of the smallest tile are 2 GiB already.
        let most = 1 << 20;
        if let Some(&(setting, value)) = counts.iter().find(|(_, value)| !(1..=most).contains(value)) {
            return Err(StreamingError::OutOfRange { setting, value, most });
        }
        match pyramid.tile_count() {
            tiles if tiles > MOST_TILES => Err(StreamingError::TooManyTiles { tiles, most: MOST_TILES }),
            _ => Ok(()),
        }
    }
}
