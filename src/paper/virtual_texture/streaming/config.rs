//! Sizes and budgets of the two caches.

use crate::math::pyramid::Pyramid;
use crate::paper::virtual_texture::choices::Order;
use crate::scene::settings;
use std::time::Duration;
use thiserror::Error;

settings! {
    /// The two caches of a virtual texture (paper 1, section 3): sizes and budgets. The paper chooses the tile pool's
    /// size by experiment and names no budget. A tile of 512 x 512 texels in RGBA8 takes 1.35 MB, with its border and
    /// its copy of half the size.
    pub struct StreamingConfig with DEFAULT {
        /// Tiles in video memory (the paper's N1). A frame of 1920 x 1080 pixels usually shows 30 to 100 tiles of 512
        /// x 512 texels.
        gpu_tiles: u32 = 192, in 1..=1 << 16, unit "tiles";
        /// Tiles in main memory (the paper's N2).
        host_tiles: u32 = 384, in 1..=1 << 20, unit "tiles";
        /// Time per frame for copies to video memory. A copy that has begun is completed even beyond this time, so at
        /// least one tile is uploaded per frame. Both time budgets are lifted while a picture settles, and in a window
        /// whose camera rests.
        upload_budget_ms: f64 = 2.0, in 1e-3..=1e6, unit "ms";
        /// CPU time per frame for reading and decoding tiles, summed over the loader threads. If a load takes longer,
        /// later frames load less. Waiting for the disk is not counted. At most 32 loads are under way.
        load_budget_ms: f64 = 8.0, in 1e-3..=1e6, unit "ms";
        /// The upload budget of `--deterministic`, and in any mode the capacity of a frame's staging memory.
        upload_tiles_per_frame: u32 = 8, in 1..=1 << 16, unit "tiles";
        /// The load budget of `--deterministic`.
        load_tiles_per_frame: u32 = 8, in 1..=1 << 16, unit "tiles";
        /// Frames in which a new tile is blended with the coarser tile shown before. 0 shows it at once, as in the
        /// paper.
        fade_in_frames: u32 = 0, in 0..=1000, unit "frames";
        /// Loads the tiles that the camera will see this many frames later if its motion continues. 0: no prefetch.
        prefetch_frames: u32 = 0, in 0..=1000, unit "frames";
        /// Which of a frame's missing tiles is requested first. After a cut to another camera, `"coarsest"` had up to
        /// 20 % less error, summed over the frames (vt.budget).
        order: Order = Order::Coarsest;
        /// A tile that could not be read is requested again after this time. 0 and `--deterministic` disable this.
        retry_after_ms: f64 = 1000.0, in 0.0..=1e9, unit "ms";
    }
    beside {
        /// Budgets count tiles instead of time. Each frame waits for the previous frame's loads and takes them in the
        /// order of their requests. The same lists give the same frames on any machine.
        deterministic: bool = false;
        /// Levels added to the level of every visible tile: `variant.level_bias`.
        level_bias: u32 = 0;
    }
}

impl StreamingConfig {
    pub fn upload_budget(&self) -> Duration {
        milliseconds(self.upload_budget_ms)
    }

    pub fn load_budget(&self) -> Duration {
        milliseconds(self.load_budget_ms)
    }

    pub fn retry_after(&self) -> Duration {
        milliseconds(self.retry_after_ms)
    }
}

fn milliseconds(ms: f64) -> Duration {
    Duration::from_secs_f64(ms / 1e3)
}

/// Settings with which no tile could be shown, or a thread that could not be created.
#[derive(Debug, Error)]
pub enum StreamingError {
    #[error("{setting} = {value}: must be 1 ..= {max}")]
    OutOfRange { setting: &'static str, value: u32, max: u32 },
    #[error("{setting} = 0: no tile would ever be loaded; set a time above 0")]
    NoTime { setting: &'static str },
    #[error("the texture has {tiles} tiles, but the state tables hold only {max}; use larger tiles")]
    TooManyTiles { tiles: u64, max: u64 },
    #[error("cannot create a loader thread: {0}; raise the limit of processes (ulimit -u)")]
    Thread(std::io::Error),
}

/// Maximum number of tiles of a texture. The two state tables take 4 bytes per tile each: 512 MiB for this number. A
/// texture of 2^20 x 2^20 texels exceeds this number by a third if its tiles have 128 x 128 texels. With tiles of 256 x
/// 256 it has a third of this number.
pub const MAX_TILES: u64 = 1 << 26;

impl StreamingConfig {
    /// True if one loader serves both settings. With counted budgets, the number of loads per frame must be equal.
    pub fn same_loader(&self, other: &StreamingConfig) -> bool {
        let counted = |config: &StreamingConfig| config.load_tiles_per_frame.min(config.host_tiles);
        self.deterministic == other.deterministic && (!self.deterministic || counted(self) == counted(other))
    }

    pub(super) fn check(&self, pyramid: &Pyramid) -> Result<(), StreamingError> {
        let mut counts = vec![
            ("gpu_tiles", self.gpu_tiles),
            ("host_tiles", self.host_tiles),
            // Checked in any mode, because it is also the capacity of a frame's staging memory.
            ("upload_tiles_per_frame", self.upload_tiles_per_frame),
        ];
        if self.deterministic {
            counts.push(("load_tiles_per_frame", self.load_tiles_per_frame));
        } else {
            let times = [("upload_budget_ms", self.upload_budget()), ("load_budget_ms", self.load_budget())];
            if let Some(&(setting, _)) = times.iter().find(|(_, time)| time.is_zero()) {
                return Err(StreamingError::NoTime { setting });
            }
        }
        // The tables store a slot as an i32, which would allow more slots. 2^20 slots of the smallest RGBA8 tile take
        // 1.25 GiB.
        let max = 1 << 20;
        if let Some(&(setting, value)) = counts.iter().find(|(_, value)| !(1..=max).contains(value)) {
            return Err(StreamingError::OutOfRange { setting, value, max });
        }
        match pyramid.tile_count() {
            tiles if tiles > MAX_TILES => Err(StreamingError::TooManyTiles { tiles, max: MAX_TILES }),
            _ => Ok(()),
        }
    }
}
