//! The settings of paper 1: which variant of each step runs, the caches and their budgets. [`PAPER`] is the paper's own.

use super::choices::{Compaction, Dedup, Filtering, Interpolation, Keying, Listing, U1Format};
use super::disk::Disk;
use super::streaming::StreamingConfig;
use crate::math::pyramid::Pyramid;
use crate::picture::Target;
use crate::scene::{Fault, Language, Part, Scene, SceneError, Table, settings};
use crate::texture::source::TileFormat;
use crate::vk::{Error, Feature, Format, Gpu, Need, Result};

mod texture;

pub use texture::{KIND, Texture, TextureError, TextureSource, open_texture, owner, source_mesh, texture};

/// What paper 1 adds to scenes.
pub const LANGUAGE: Language = Language {
    tables: &[
        Table::of::<Texture>(&["surface", "*", "texture"]),
        Table::of::<Filter>(&["surface", "*", "filter"]),
        Table::of::<Config>(&["variant"]),
        Table::of::<StreamingConfig>(&["cache"]),
        Table::of::<Disk>(&["disk"]),
    ],
    check,
};

fn check(scene: &Scene) -> std::result::Result<(), SceneError> {
    if owner(scene)?.is_some() {
        return Ok(());
    }
    for section in ["variant", "cache", "disk"].into_iter().filter(|section| scene.has(&[*section])) {
        tracing::warn!("{}: no effect, no surface has a virtual texture", scene.place(&[section]));
    }
    Ok(())
}

settings! {
    /// How a pixel's colour is taken from a texture.
    pub struct Filter derive(Copy, Eq) with DEFAULT {
        /// The method.
        kind: Filtering = Filtering::Trilinear;
        /// NA: samples along a footprint at most; no more than a virtual texture's border has texels, unless stochastic.
        max_anisotropy: u32 = 1, in 1..=16;
        /// Texels a pixel of the stochastic filter.
        samples: u32 = 1, in 1..=64;
        /// How a tile's two levels are blended.
        interpolation: Interpolation = Interpolation::Corrected;
    }
}

settings! {
    /// Which variant of each step makes the list of visible tiles (paper 1, section 2). The defaults are what the paper
    /// describes, with the p that it leaves open set to the best one measured on lavapipe.
    pub struct Config derive(Copy, Eq) with DEFAULT {
        /// Format of the request image; left out: the first of these that the device renders to.
        u1: Option<U1Format> = None;
        /// Which method makes the list; the other keys of stages 2 and 3 are for `"device"`.
        list: Listing = Listing::Device;
        /// n of the list `"feedback"`: a frame looks at one pixel of 2^n.
        feedback_log2: u32 = 6, in 0..=8;
        /// Stage 2: how the pixels' triples become marks.
        dedup: Dedup = Dedup::Geometry;
        /// p of the geometry shader's stage 2: blocks of 2^p x 2^p pixels.
        block_log2: u32 = 3, in 0..=4;
        /// The geometry shader emits a point only where the triple differs from the last one.
        memo: bool = true;
        /// Where a tile is marked.
        keying: Keying = Keying::Paper;
        /// Stage 3: how the marks become a list.
        compact: Compaction = Compaction::TransformFeedback;
        /// p of the geometry shader's stage 3: blocks of 2^p x 2^p texels of the tile mask.
        compact_block_log2: u32 = 2, in 0..=2;
        /// Levels added to every pixel's.
        level_bias: u32 = 0, in 0..=20, unit "levels";
        /// Triples that the list has room for at first; it grows where they do not suffice.
        list_capacity: u32 = 65_536, in 1..=1 << 26, unit "triples";
    }
    beside {
        /// Of the surface that has the texture.
        filter: Filter = Filter::DEFAULT;
        /// `cache.fade_in_frames`.
        fade_in_frames: u32 = 0;
    }
    check check_config;
}

fn check_config(config: &Config, part: &Part<'_>) -> std::result::Result<(), Fault> {
    let appends = config.list == Listing::Device && config.compact == Compaction::FusedAppend;
    if appends && !config.dedup.fused() {
        return Err(part.fault("compact", Compaction::FUSED_APPEND_ALONE));
    }
    Ok(())
}

/// What the paper describes: the defaults of scenes.
pub const PAPER: Config = Config::DEFAULT;

impl U1Format {
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
            None => U1Format::ALL.iter().copied().find(usable),
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

/// Whether the settings go with the texture that was opened: its variants with the pyramid, its filter with the border,
/// which only the file may know.
///
/// # Errors
/// [`SceneError`] at the key that does not fit.
pub fn check_opened(
    scene: &Scene,
    config: &Config,
    pyramid: &Pyramid,
) -> std::result::Result<(), SceneError> {
    if let Err(unfit) = config.check(pyramid) {
        return Err(scene.fault(&["variant", unfit.key], format!("{:?}: {}", unfit.value, unfit.why)));
    }
    let (filter, border) = (config.filter, pyramid.border_texels());
    let reach = filter.max_anisotropy;
    match owner(scene)? {
        Some(surface) if reach > 1 && reach > border && filter.kind != Filtering::Stochastic => {
            let what = format!(
                "{reach} samples reach as many texels beyond a tile's edge, and the texture's border has {border}; lower \
                 it, take a wider border, or kind = \"stochastic\""
            );
            Err(scene.fault(&["surface", &surface.name, "filter", "max_anisotropy"], what))
        }
        _ => Ok(()),
    }
}

/// All that a renderer needs besides the mesh and the texture.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Pixels.
    pub size: [u32; 2],
    pub config: Config,
    pub streaming: StreamingConfig,
    pub target: Target,
}

impl Settings {
    /// What a scene asks for.
    ///
    /// # Errors
    /// A section or a filter that does not do.
    pub fn of_scene(scene: &Scene, target: Target) -> std::result::Result<Settings, SceneError> {
        let mut config: Config = scene.read(&["variant"])?;
        let mut streaming: StreamingConfig = scene.read(&["cache"])?;
        if let Some(surface) = owner(scene)? {
            config.filter = scene.read(&["surface", &surface.name, "filter"])?;
        }
        config.fade_in_frames = streaming.fade_in_frames;
        streaming.level_bias = config.level_bias;
        Ok(Settings { size: [scene.view.width, scene.view.height], config, streaming, target })
    }
}
