//! The settings of a scene: texture, caches, mesh, view, and the variant of the pipeline.

use super::choice::{Compaction, Dedup, Listing};
use crate::math::pyramid::{Pyramid, PyramidError};
use crate::texture::source::TileFormat;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What the landscape is covered with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Texture {
    pub source: TextureSource,
    /// m and n: level 0 has `2^m x 2^n` texels. `None` only for a file, which knows its own size; where a
    /// scene states one for a file, it must be the file's.
    pub size_log2: Option<[u32; 2]>,
    /// Payload side of a tile in texels, a power of two.
    pub tile_size: u32,
    /// Texels of the neighbours around each tile.
    pub border: u32,
    /// L'; `None` takes the fewest possible.
    pub resident_levels: Option<u32>,
    /// Of generated tiles; a file has its own.
    pub format: TileFormat,
}

impl Texture {
    /// The pyramid that the scene states; `None` where only the file knows its size.
    ///
    /// # Errors
    /// [`PyramidError`], possible only after a field was changed by hand.
    pub fn pyramid(&self) -> Result<Option<Pyramid>, PyramidError> {
        let Some([width_log2, height_log2]) = self.size_log2 else { return Ok(None) };
        let tile_log2 = self.tile_size.max(1).ilog2();
        Pyramid::new(width_log2, height_log2, tile_log2, self.border, self.resident_levels).map(Some)
    }
}

/// Where the texels come from.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TextureSource {
    /// Real imagery of the earth with labelled synthetic detail below it.
    Earth,
    /// Every texel is a hash of its level and place.
    Ruler,
    /// A pyramid on disk; the path is ready to open.
    File(PathBuf),
}

/// Sizes and budgets of the two caches (paper 1, section 3).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Cache {
    /// N1: tiles in video memory.
    pub gpu_tiles: u32,
    /// N2: tiles in main memory.
    pub host_tiles: u32,
    /// A2's time in a frame.
    pub upload_budget_ms: f64,
    /// A3's time in a frame.
    pub load_budget_ms: f64,
    /// A2's tiles in a frame where budgets count tiles instead of time; in any mode at most so many.
    pub upload_tiles_per_frame: u32,
    /// A3's tiles in a frame, where budgets count tiles instead of time.
    pub load_tiles_per_frame: u32,
    /// Frames in which a tile that has arrived is mixed with what was shown before it, 0 ..= 1000; 0: at once.
    pub fade_in_frames: u32,
    /// Tiles are fetched ahead that the camera will see in so many frames, 0 ..= 1000; 0: none are.
    pub prefetch_frames: u32,
    /// Which of a frame's missing tiles is asked for first. Coarsest: after a cut it left 16 to 31 % less error, summed
    /// over the frames (vt.budget).
    pub order: Order,
    /// After what time a tile that could not be read is asked for again; 0: never.
    pub retry_after_ms: f64,
}

/// In which order missing tiles are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Order {
    /// The finest level first.
    Finest,
    /// The coarsest level first.
    Coarsest,
}

impl Default for Cache {
    /// A 512 tile of RGBA8 with border and its second picture takes 1.35 MB: 260 MB and 520 MB.
    fn default() -> Self {
        Self {
            gpu_tiles: 192,
            host_tiles: 384,
            upload_budget_ms: 2.0,
            load_budget_ms: 8.0,
            upload_tiles_per_frame: 8,
            load_tiles_per_frame: 8,
            fade_in_frames: 0,
            prefetch_frames: 0,
            order: Order::Coarsest,
            retry_after_ms: 1000.0,
        }
    }
}

/// The landscape.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum MeshSpec {
    /// [`crate::model::mesh::earth`].
    Earth { columns: u32, rows: u32 },
    /// [`crate::model::mesh::plane`].
    Plane { width_m: f64, height_m: f64, columns: u32, rows: u32 },
}

/// The picture to make.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct View {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// A name among the scene's cameras.
    pub camera: String,
    /// A name among the scene's paths; the eye then follows it from its own start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
}

/// How U1 stores a pixel's triple (paper 1, section 2.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TriplesFormat {
    /// The first of the others that the device renders to, in this order.
    #[default]
    Auto,
    /// The paper's: three channels of 32 bits.
    Rgb32,
    /// Four channels of 32 bits, the last unused.
    Rgba32,
    /// One channel of 32 bits.
    Packed,
}

/// Where a triple's bit stands in U2 (paper 1, section 2.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Keying {
    /// At the tile's cell of level 0, as printed: U3 can hold a tile up to 4^q times.
    #[default]
    Paper,
    /// At (j >> q, i >> q): U3 holds each tile once.
    Native,
}

/// How a tile's two levels are blended (paper 1, section 4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// `C1 (1 - f) + C2 f`.
    #[default]
    Corrected,
    /// `C1 f + C2 (1 - f)`, as printed.
    Literal,
}

/// How a pixel's colour is taken from its tile (paper 1, section 4). In the order of `filter.glsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Filtering {
    /// The paper's: bilinear in two levels, and between them; `max_anisotropy` such samples.
    #[default]
    Trilinear,
    /// Bilinear in the nearer of the two levels.
    Bilinear,
    /// `samples` single texels, each chosen with its weight in the trilinear filter: needs no border, and is noisy.
    Stochastic,
}

/// Which of the pipeline's variants runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Variant {
    pub u1: TriplesFormat,
    /// Who makes the list of visible tiles; the other keys of stages 2 and 3 are for "device".
    pub list: Listing,
    /// n of the list "feedback": a frame looks at one pixel of 2^n, 0 ..= 8.
    pub feedback_log2: u32,
    /// Stage 2.
    pub dedup: Dedup,
    /// p of the geometry shader's stage 2: blocks of `2^p x 2^p` pixels, 0 ..= 4.
    pub block_log2: u32,
    /// Its memo: emit only when the next texel's triple differs.
    pub memo: bool,
    pub keying: Keying,
    /// Stage 3.
    pub compact: Compaction,
    /// p of the geometry shader's stage 3: blocks of `2^p x 2^p` texels of U2, 0 ..= 2.
    pub compact_block_log2: u32,
    /// NA: samples along a footprint at most, 1 ..= 16; no more than the border has texels, unless stochastic.
    pub max_anisotropy: u32,
    pub filter: Filtering,
    /// Taps of a pixel, of the stochastic filter alone, 1 ..= 64.
    pub samples: u32,
    pub interpolation: Interpolation,
    /// Levels added to every wish, 0 ..= 20.
    pub level_bias: u32,
    /// Elements of U3 at the start; it grows where they do not suffice.
    pub list_capacity: u32,
}

impl Default for Variant {
    fn default() -> Self {
        Self {
            u1: TriplesFormat::Auto,
            list: Listing::default(),
            feedback_log2: 6,
            dedup: Dedup::default(),
            block_log2: 3,
            memo: true,
            keying: Keying::Paper,
            compact: Compaction::default(),
            compact_block_log2: 2,
            max_anisotropy: 1,
            filter: Filtering::Trilinear,
            samples: 1,
            interpolation: Interpolation::Corrected,
            level_bias: 0,
            list_capacity: 65_536,
        }
    }
}
