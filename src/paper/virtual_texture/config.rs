//! The settings of paper 1: which variant of each step runs, the caches and their budgets. [`PAPER`] is the paper's own.

use super::streaming::{Order, StreamingConfig};
use super::{Compaction, Dedup, Filtering, Keying, Listing};
use crate::math::pyramid::Pyramid;
use crate::picture::Target;
use crate::scene::{self, Scene, TriplesFormat};
use crate::texture::source::TileFormat;
use crate::vk::{Error, Feature, Format, Gpu, Need, Result};
use std::time::Duration;

/// How a pixel's triple is stored in `U1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum U1Format {
    /// The paper's: 32 bits in each of r, g, b. Few devices render to it.
    Rgb32,
    Rgba32,
    /// One word: q, i, j side by side.
    Packed,
}

/// How a pixel mixes its two levels (section 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// `C1 (1-f) + C2 f`
    Corrected,
    /// `C1 f + C2 (1-f)`, as printed.
    Literal,
}

/// The settings of one variant. [`PAPER`] is the paper's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    /// `None`: the paper's format where the device renders to it, else the next in [`U1Format`]'s order.
    pub u1: Option<U1Format>,
    /// Who makes the list; the settings of stages 2 and 3 are the device's.
    pub list: Listing,
    /// n of [`Listing::Feedback`]: one pixel of 2^n a frame, 0 ..= 8.
    pub feedback_log2: u32,
    /// Stage 2.
    pub dedup: Dedup,
    /// p: the geometry shader's blocks are `2^p x 2^p` pixels, 0 ..= 4.
    pub block_log2: u32,
    /// The geometry shader emits a point only where the triple differs from the last one.
    pub memo: bool,
    pub keying: Keying,
    /// Stage 3.
    pub compact: Compaction,
    /// Its geometry shader's blocks are `2^p x 2^p` texels of `U2`, 0 ..= 2.
    pub compact_block_log2: u32,
    /// NA of the level formula.
    pub max_anisotropy: u32,
    pub filter: Filtering,
    /// Taps of a pixel, of the stochastic filter alone.
    pub samples: u32,
    pub interpolation: Interpolation,
    /// Frames in which a tile that has arrived is mixed with what was shown before it; 0: shown at once, as in the paper.
    pub fade_in_frames: u32,
    /// Triples that `U3` first has room for; more are found by a second run of the same frame.
    pub list_capacity: u32,
}

/// What the paper describes, with the p that it leaves open set to the best one measured on lavapipe.
pub const PAPER: Config = Config {
    u1: None,
    list: Listing::Device,
    feedback_log2: 6,
    dedup: Dedup::Geometry,
    block_log2: 3,
    memo: true,
    keying: Keying::Paper,
    compact: Compaction::TransformFeedback,
    compact_block_log2: 2,
    max_anisotropy: 1,
    filter: Filtering::Trilinear,
    samples: 1,
    interpolation: Interpolation::Corrected,
    fade_in_frames: 0,
    list_capacity: 65_536,
};

impl U1Format {
    pub const ALL: [U1Format; 3] = [U1Format::Rgb32, U1Format::Rgba32, U1Format::Packed];

    pub fn image_format(self) -> Format {
        match self {
            U1Format::Rgb32 => Format::Rgb32Uint,
            U1Format::Rgba32 => Format::Rgba32Uint,
            U1Format::Packed => Format::R32Uint,
        }
    }

    /// 32-bit words of a texel.
    pub fn words(self) -> usize {
        match self {
            U1Format::Rgb32 => 3,
            U1Format::Rgba32 => 4,
            U1Format::Packed => 1,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            U1Format::Rgb32 => "rgb32",
            U1Format::Rgba32 => "rgba32",
            U1Format::Packed => "packed",
        }
    }

    /// Whether (q, i, j) of this pyramid fit one word with all ones to spare for the background.
    pub fn fits(self, pyramid: &Pyramid) -> bool {
        let bits = pyramid.width_log2() + pyramid.height_log2() - 2 * pyramid.tile_log2();
        // The largest stored q is L-L'+1; its successor must not be reached, or all ones could be a triple.
        self != U1Format::Packed
            || (bits < 32 && pyramid.first_resident_level() < (1 << (32 - bits).min(31)) - 1)
    }

    /// The format to use: as configured, or the first that the device renders to.
    ///
    /// # Errors
    /// [`Error::Limit`] where the configured one cannot be, with the ones that can.
    pub fn choose(gpu: &Gpu, wanted: Option<U1Format>, pyramid: &Pyramid) -> Result<U1Format> {
        let usable = |format: &U1Format| gpu.renders_to(format.image_format()) && format.fits(pyramid);
        let found = match wanted {
            Some(format) => Some(format).filter(usable),
            None => U1Format::ALL.into_iter().find(usable),
        };
        found.ok_or_else(|| {
            let others: Vec<_> = U1Format::ALL.iter().filter(|f| usable(f)).map(|f| f.name()).collect();
            Error::Limit {
                object: "U1".into(),
                what: format!(
                    "format {} is not to be had for this device and texture; these are: {}",
                    wanted.map_or("auto", U1Format::name),
                    others.join(", ")
                ),
            }
        })
    }
}

/// Device features that a scene of this variant needs whose texture has tiles of `format`: give them to [`Gpu::new`].
pub fn needs(config: &Config, format: TileFormat) -> Vec<Need> {
    let blocks = Need {
        feature: Feature::TextureCompressionBc,
        pass: "texturing",
        without: "bake the texture with --format rgba8, or choose another --device",
    };
    let blocks = (format == TileFormat::Bc1).then_some(blocks);
    config.needs().into_iter().chain(blocks).collect()
}

/// All that a renderer needs besides the mesh and the texture.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Pixels.
    pub size: [u32; 2],
    pub config: Config,
    pub streaming: StreamingConfig,
    /// Tiles are fetched ahead that the camera will see in so many frames, if it goes on as it does; 0: none are.
    pub prefetch_frames: u32,
    pub target: Target,
}

impl Settings {
    /// What a scene asks for.
    pub fn of_scene(scene: &Scene, target: Target) -> Settings {
        let (variant, cache) = (&scene.variant, &scene.cache);
        let milliseconds = |ms: f64| Duration::from_secs_f64(ms / 1e3);
        Settings {
            size: [scene.view.width, scene.view.height],
            config: Config {
                u1: match variant.u1 {
                    TriplesFormat::Auto => None,
                    TriplesFormat::Rgb32 => Some(U1Format::Rgb32),
                    TriplesFormat::Rgba32 => Some(U1Format::Rgba32),
                    TriplesFormat::Packed => Some(U1Format::Packed),
                },
                list: variant.list,
                feedback_log2: variant.feedback_log2,
                dedup: variant.dedup,
                block_log2: variant.block_log2,
                memo: variant.memo,
                keying: match variant.keying {
                    scene::Keying::Paper => Keying::Paper,
                    scene::Keying::Native => Keying::Native,
                },
                compact: variant.compact,
                compact_block_log2: variant.compact_block_log2,
                max_anisotropy: variant.max_anisotropy,
                filter: variant.filter,
                samples: variant.samples,
                interpolation: match variant.interpolation {
                    scene::Interpolation::Corrected => Interpolation::Corrected,
                    scene::Interpolation::Literal => Interpolation::Literal,
                },
                fade_in_frames: cache.fade_in_frames,
                list_capacity: variant.list_capacity,
            },
            streaming: StreamingConfig {
                gpu_tiles: cache.gpu_tiles,
                host_tiles: cache.host_tiles,
                upload_budget: milliseconds(cache.upload_budget_ms),
                load_budget: milliseconds(cache.load_budget_ms),
                upload_tiles_per_frame: cache.upload_tiles_per_frame,
                load_tiles_per_frame: cache.load_tiles_per_frame,
                deterministic: false,
                level_bias: variant.level_bias,
                order: match cache.order {
                    scene::Order::Finest => Order::Finest,
                    scene::Order::Coarsest => Order::Coarsest,
                },
                retry_after: milliseconds(cache.retry_after_ms),
            },
            prefetch_frames: cache.prefetch_frames,
            target,
        }
    }
}
