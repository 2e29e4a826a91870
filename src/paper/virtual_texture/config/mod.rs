//! The settings of paper 1: which variant of each step runs, the caches and their budgets. [`PAPER`] has the paper's
//! values.

use super::choices::{
    Compaction, Dedup, FilterAxes, FilterDeterminant, FilterEdge, FilterKernel, FilterLimb, FilterMap,
    FilterScan, Filtering, Interpolation, Listing, RequestDraw, RequestFormat, TileAddress,
};
use super::disk::Disk;
use super::streaming::StreamingConfig;
use crate::math::pyramid::Pyramid;
use crate::picture::PixelFormat;
use crate::scene::{
    Language, Scene, SceneError, SceneFault, SceneTable, Surface, TableDeclaration, settings,
    unread_filter_keys,
};
use crate::texture::source::TileFormat;
use crate::vk::{Error, Feature, Format, Gpu, Need, Result};

mod texture;
mod weight_map;

pub use texture::{
    KIND, TextureError, TextureSource, VirtualTextureSource, open_texture, owner, source_mesh, texture,
};

/// What paper 1 adds to scenes.
pub const LANGUAGE: Language = Language {
    tables: &[
        TableDeclaration::of::<VirtualTextureSource>(&["surface", "*", "texture"]),
        TableDeclaration::of::<Filter>(&["surface", "*", "filter"]),
        TableDeclaration::of::<Config>(&["variant"]),
        TableDeclaration::of::<StreamingConfig>(&["cache"]),
        TableDeclaration::of::<Disk>(&["disk"]),
    ],
    check,
};

fn check(scene: &Scene) -> std::result::Result<(), SceneError> {
    let owner = owner(scene)?;
    for surface in scene.surfaces.values().filter(|surface| surface.auto.is_some()) {
        if owner.is_some_and(|owner| surface.grid().is_none() || owner.name != surface.name) {
            let what = "\"auto\" is measured for a virtual texture on an ellipsoid, a plane or a cylinder, and in \
                        scenes without a virtual texture; name a filter: { kind = ... }";
            return Err(scene.fault(&["surface", &surface.name, "filter"], what));
        }
    }
    if owner.is_some() {
        return Ok(());
    }
    for section in ["variant", "cache", "disk"].into_iter().filter(|section| scene.has(&[*section])) {
        tracing::warn!("{}: has no effect without a virtual texture", scene.place(&[section]));
    }
    Ok(())
}

settings! {
    /// How a pixel's colour is filtered from a texture. The filters of paper 3 (`"ellipse"` and the published filters
    /// after it) run on plain and on virtual textures. On a virtual texture they fetch each texel through the page
    /// table, with any border. If a texel's tile is not resident, they get the texel of the nearest coarser resident
    /// level that covers it. If samples lie further than half a tile from the pixel's centre, the level is raised.
    /// Paper 3's other methods are measured in the figures `tm.*` only. A summed-area table for each tile would have 16
    /// bytes per texel, in video memory and in each upload: 4 times those of rgba8, 32 times those of bc1. A device's
    /// anisotropic sampler cannot follow the page table, nor be confined to a tile: lavapipe 22 ignores the gradients
    /// of `textureGrad` and takes the footprint from the coordinates of a quad's pixels, which may be in different
    /// tiles. Object-space texturing filters no pixels (it draws fragments of rotated polygons), and incremental
    /// coordinates need whole rows of one polygon in order (tm.17, tm.drift). A key that the kind does not read is an
    /// error. An override that changes only `kind` drops such keys without an error.
    pub struct Filter derive(Copy) with DEFAULT {
        /// The method.
        kind: Filtering = Filtering::Trilinear;
        /// For `"trilinear"` and `"feline"`: the maximum number of samples along a footprint (the paper's NA). Today's
        /// hardware takes at most 16, too. For `"mavridis"`: the number of taps. For `"ellipse"`: the greatest ratio of
        /// its axes, up to 64; a longer footprint is widened. `"pbrt"` and `"stochastic-ellipse"` do not have it. The
        /// sampler of a plain texture takes one sample.
        max_anisotropy: u32 = 16, in 1..=64;
        /// For `"ellipse"`: the least number of texels along its minor semi-axis. Twice this number reads four times as
        /// many texels and reduces the error (scene.filters). With the value 0, as in paper 3, every footprint is
        /// filtered in level 0, unless it has more than about 4,000 texels there or reaches further than half a tile.
        minor_texels: f64 = 2.0, in 0.0..=4.0, unit "texels";
        /// For `"ellipse"`: the reconstruction term k, in squared texels of level 0, added to both diagonal entries of
        /// the ellipse's matrix. Paper 3 has 0. In each level, the squared minor semi-axis has at least k squared
        /// texels. So from 1/2 on, every ellipse contains a texel's centre. A pixel whose ellipse contains none shows
        /// the nearest texel.
        k: f64 = 0.8, in 0.0..=4.0, unit "squared texels";
        /// For `"ellipse"`: the texels that are visited. This changes the cost. It changes the picture only where an
        /// ellipse has so many texels that its level is raised. The bounding box has more texels, so its level is
        /// raised earlier.
        scan: FilterScan = FilterScan::RowSpan;
        /// For `"ellipse"`: the formula for the determinant of its matrix.
        determinant: FilterDeterminant = FilterDeterminant::AllPositive;
        /// For `"ellipse"`: the axes that its weights follow.
        axes: FilterAxes = FilterAxes::Corrected;
        /// For `"ellipse"`: the Gaussian.
        kernel: FilterKernel = FilterKernel::Ewa;
        /// For `"ellipse"`: the weight of a texel that its edge cuts. With `"none"` a fifth to two fifths fewer texels
        /// are read, and the NMSE of minified views is at most 1.7 times as large (scene.filters); but magnified texels
        /// have visible edges.
        edge: FilterEdge = FilterEdge::AreaRamp;
        /// For `"ellipse"`: a table in place of the kernel's formula.
        weight_map: FilterMap = FilterMap::None;
        /// For a weight map: entries along each side; a power of two.
        map_entries: u32 = 64, in 4..=256, unit "entries";
        /// For a weight map: bits per entry, 8 or 16.
        map_bits: u32 = 16, in 8..=16, unit "bits";
        /// For the maps `"radial"` and `"squared-radius"`: interpolates the two nearest entries.
        map_linear: bool = false;
        /// Texels per pixel of the stochastic filters.
        samples: u32 = 1, in 1..=64;
        /// For paper 1's filters, `"trilinear"`, `"bilinear"` and `"stochastic"`: how the two levels of a tile (the
        /// tile, and its copy of half the size) are blended.
        interpolation: Interpolation = Interpolation::Corrected;
        /// The footprint at the limb of an ellipsoid. If omitted: `"facet"` for paper 1's filters, so that their levels
        /// and lists are the paper's, and `"bounded"` for paper 3's filters. Other surfaces are not bounded: a plane
        /// and the inside of a cylinder have no limb, and the curvature of a progressive mesh is not known.
        limb: Option<FilterLimb> = None;
    }
    check check_filter;
}

/// The greatest [`Filter::max_anisotropy`] of filters other than the ellipse.
pub const MAX_SAMPLES: u32 = 16;

fn check_filter(filter: &Filter, part: &SceneTable<'_>) -> std::result::Result<(), SceneFault> {
    if let Some((key, kinds)) = unread_filter_keys(filter.kind.name()).find(|(key, _)| part.states(key)) {
        let what = format!(
            "kind = {:?} does not read it; remove the key, or use kind = {}",
            filter.kind.name(),
            kinds.iter().map(|kind| format!("{kind:?}")).collect::<Vec<_>>().join(" or ")
        );
        return Err(part.fault(key, what));
    }
    if filter.kind != Filtering::Ellipse && filter.max_anisotropy > MAX_SAMPLES {
        let what = format!(
            "{} is above {MAX_SAMPLES}, the most for kind = \"{}\"; only kind = \"ellipse\" takes a ratio of up to 64",
            filter.max_anisotropy,
            filter.kind.name()
        );
        return Err(part.fault("max_anisotropy", what));
    }
    weight_map::check(filter, part)
}

settings! {
    /// The variant of each step that makes the list of visible tiles (paper 1, section 2). The defaults are the
    /// paper's. The paper does not give the side 2^p of stage 2's blocks; the default was the fastest on lavapipe
    /// (vt.dedup).
    pub struct Config derive(Copy) with DEFAULT {
        /// Format of the request image. If omitted: the first format of this list that the device can render to.
        request_format: Option<RequestFormat> = None;
        /// Stage 1: the draw that writes the request image. A fused variant has no request image.
        request_draw: RequestDraw = RequestDraw::Separate;
        /// Which method makes the list. The keys of stages 2 and 3 apply only to `"device"`.
        list: Listing = Listing::Device;
        /// n of the list `"feedback"`: each frame samples one pixel in 2^n.
        feedback_log2: u32 = 6, in 0..=8;
        /// Stage 2: how the bits of the tile mask are set.
        dedup: Dedup = Dedup::Geometry;
        /// p of the geometry shader's stage 2: blocks of 2^p x 2^p pixels.
        block_log2: u32 = 3, in 0..=4;
        /// The geometry shader emits a point only if the triple differs from the previous pixel's.
        memo: bool = true;
        /// The grid in which the tile mask and the list address a tile.
        address: TileAddress = TileAddress::Level0;
        /// Stage 3: how the tile mask becomes a list.
        compact: Compaction = Compaction::TransformFeedback;
        /// p of the geometry shader's stage 3: blocks of 2^p x 2^p texels of the tile mask.
        compact_block_log2: u32 = 2, in 0..=2;
        /// Added to the level of every pixel.
        level_bias: u32 = 0, in 0..=20, unit "levels";
        /// Initial capacity of the list. It grows if a frame exceeds it.
        list_capacity: u32 = 65_536, in 1..=1 << 26, unit "triples";
    }
    beside {
        /// The filter of the surface that has the texture.
        filter: Filter = Filter::DEFAULT;
        /// `cache.fade_in_frames`.
        fade_in_frames: u32 = 0;
    }
    check check_config;
}

fn check_config(config: &Config, part: &SceneTable<'_>) -> std::result::Result<(), SceneFault> {
    let appends = config.list == Listing::Device && config.compact == Compaction::FusedAppend;
    if appends && !config.dedup.fused() {
        return Err(part.fault("compact", Compaction::FUSED_APPEND_ALONE));
    }
    if config.fused() && config.request_draw == RequestDraw::Texturing {
        let what = "the fused draw of this variant.dedup stores no triples; remove the key, or choose variant.dedup = \
                    \"runs\"";
        return Err(part.fault("request_draw", what));
    }
    Ok(())
}

/// The paper's settings, which are the defaults of scenes.
pub const PAPER: Config = Config::DEFAULT;

/// The paper's settings with NA = 1, for figures and tests of something other than anisotropy.
pub const ONE_SAMPLE: Config = Config { filter: Filter::ONE_SAMPLE, ..PAPER };

impl RequestFormat {
    pub fn image_format(self) -> Format {
        match self {
            RequestFormat::Rgb32 => Format::Rgb32Uint,
            RequestFormat::Rgba32 => Format::Rgba32Uint,
            RequestFormat::Packed => Format::R32Uint,
        }
    }

    /// 32-bit words of a texel.
    pub fn words(self) -> usize {
        match self {
            RequestFormat::Rgb32 => 3,
            RequestFormat::Rgba32 => 4,
            RequestFormat::Packed => 1,
        }
    }

    /// True if (q, i, j) of this pyramid fits the format, with all ones reserved for the background. With `reaches`,
    /// four bits of the word hold the filter's reach.
    pub fn fits(self, pyramid: &Pyramid, reaches: bool) -> bool {
        let triple = pyramid.width_log2() + pyramid.height_log2() - 2 * pyramid.tile_log2();
        let bits = triple + if reaches { 4 } else { 0 };
        // The largest stored q is the first resident level. It must be less than the background's q, which is all
        // ones.
        self != RequestFormat::Packed
            || (bits < 32 && pyramid.first_resident_level() < (1 << (32 - bits).min(31)) - 1)
    }

    /// The format to use: as configured, or the first that the device renders to.
    ///
    /// # Errors
    /// [`Error::Limit`] if the configured format is not available. The error names the available formats.
    pub fn choose(
        gpu: &Gpu,
        wanted: Option<RequestFormat>,
        pyramid: &Pyramid,
        reaches: bool,
    ) -> Result<RequestFormat> {
        let usable =
            |format: &RequestFormat| gpu.renders_to(format.image_format()) && format.fits(pyramid, reaches);
        let found = match wanted {
            Some(format) => Some(format).filter(usable),
            None => RequestFormat::ALL.iter().copied().find(usable),
        };
        found.ok_or_else(|| {
            let others: Vec<_> = RequestFormat::ALL.iter().filter(|f| usable(f)).map(|f| f.name()).collect();
            Error::Limit {
                object: "request image".into(),
                what: format!(
                    "format {} is not available for this device and texture; available: {}",
                    wanted.map_or("auto", RequestFormat::name),
                    others.join(", ")
                ),
            }
        })
    }
}

/// The device features that this variant needs for tiles of `format`, for [`Gpu::new`].
pub fn needs(config: &Config, format: TileFormat) -> Vec<Need> {
    let blocks = Need {
        feature: Feature::TextureCompressionBc,
        pass: "texturing",
        without: "bake the texture with --format rgba8, or choose another --device",
    };
    let blocks = (format == TileFormat::Bc1).then_some(blocks);
    config.needs().into_iter().chain(blocks).collect()
}

/// Why the device cannot run `config` with tiles of `format`; `None` if it can.
pub fn lacks(gpu: &Gpu, config: &Config, pyramid: &Pyramid, format: TileFormat) -> Option<String> {
    if let Err(unfit) = config.check(pyramid) {
        return Some(unfit.to_string());
    }
    let missing = needs(config, format).into_iter().find(|need| !gpu.has(need.feature))?;
    Some(format!("the device lacks {}, which pass {:?} needs", missing.feature.name(), missing.pass))
}

/// Checks the settings against the opened texture: the variants against its pyramid, the filter against its border. If
/// the texture is a file, pyramid and border are known only after the file is opened.
///
/// # Errors
/// [`SceneError`] at the invalid key.
pub fn check_opened(
    scene: &Scene,
    config: &Config,
    pyramid: &Pyramid,
) -> std::result::Result<(), SceneError> {
    if let Err(unfit) = config.check(pyramid) {
        return Err(scene.fault(&["variant", unfit.key], format!("{:?}: {}", unfit.value, unfit.why)));
    }
    match (owner(scene)?, config.filter.tile_fault(pyramid.border_texels(), pyramid.tile_size())) {
        (Some(surface), Some((key, what))) => {
            Err(scene.fault(&["surface", &surface.name, "filter", key], what))
        }
        _ => Ok(()),
    }
}

impl Filter {
    /// The paper's filter with NA = 1: one trilinear sample per pixel.
    pub const ONE_SAMPLE: Filter = Filter { max_anisotropy: 1, ..Filter::DEFAULT };

    /// The narrowest border of a tile, in texels. With several samples, each sample looks up its own tile and reads
    /// both of the tile's levels, up to 2 texels beyond the tile. A single sample works without a border but shows
    /// seams, as the paper's tiles do. Filters that fetch single texels need no border.
    pub fn min_border(&self) -> u32 {
        match (self.kind, self.max_anisotropy) {
            (Filtering::Trilinear | Filtering::Bilinear, 2..) => 2,
            _ => 0,
        }
    }

    /// The invalid key and the reason, if tiles with this border and payload do not suffice for the filter.
    pub fn tile_fault(&self, border: u32, tile_size: u32) -> Option<(&'static str, String)> {
        let min = self.min_border();
        if border < min {
            let what = format!(
                "with several samples (here up to {}) a sample reads up to {min} texels beyond a tile's edge, but \
                the texture's border has {border}; use a wider border, max_anisotropy = 1, or kind = \"ellipse\" or \
                \"stochastic\"",
                self.max_anisotropy
            );
            return Some(("max_anisotropy", what));
        }
        // The two outermost of n samples lie at most n - 1 texels from the pixel's centre.
        let max = tile_size / 2 + 1;
        let wide = self.samples_reach(border) && self.max_anisotropy > max;
        let what = || {
            let wanted = self.max_anisotropy;
            format!(
                "{wanted} samples reach further than half a tile of {tile_size} texels; use at most {max}, or \
                larger tiles"
            )
        };
        wide.then(|| ("max_anisotropy", what()))
    }

    /// True if the filter may read texels beyond a tile's border, from other tiles. The outermost of n samples also
    /// reads the next coarser level, up to n texels (of the finer level) from the pixel's centre.
    pub fn reaches(&self, border: u32) -> bool {
        self.kind.is_of_paper_3() || self.samples_reach(border)
    }

    /// True if footprints are bounded at the limb of a sphere.
    pub fn bounds_limb(&self) -> bool {
        self.limb.map_or(self.kind.is_of_paper_3(), |limb| limb == FilterLimb::Bounded)
    }

    /// Specialization constants of `surface_filter_level.glsl` and `ellipse_level.glsl`.
    pub fn level_constants(&self) -> Vec<(&'static str, u32)> {
        vec![
            ("FILTER", self.kind as u32),
            ("MAX_ANISOTROPY", self.max_anisotropy),
            ("BOUNDS_LIMB", u32::from(self.bounds_limb())),
            ("MINOR_TEXELS", (self.minor_texels as f32).to_bits()),
            ("RADIUS", self.kernel.radius_and_alpha()[0].to_bits()),
            ("EDGE", self.edge as u32),
            ("K", (self.k as f32).to_bits()),
            ("ROW_SPAN", u32::from(self.scan == FilterScan::RowSpan)),
            ("ALL_POSITIVE", u32::from(self.determinant == FilterDeterminant::AllPositive)),
        ]
    }

    /// The constants of [`Filter::level_constants`], and the specialization constants of `surface_filter.glsl`.
    pub fn constants(&self) -> Vec<(&'static str, u32)> {
        // Random texels of the ellipse have the probabilities of the usual EWA filter.
        let kernel = if self.kind == Filtering::Ellipse { self.kernel } else { FilterKernel::Ewa };
        let of_texels = [
            ("SAMPLES", self.samples),
            ("AXES", self.axes as u32),
            ("ALPHA", kernel.radius_and_alpha()[1].to_bits()),
        ];
        [&self.level_constants()[..], &of_texels, self.map_constants().as_slice().as_flattened()].concat()
    }

    fn samples_reach(&self, border: u32) -> bool {
        let interpolates = matches!(self.kind, Filtering::Trilinear | Filtering::Bilinear);
        interpolates && self.max_anisotropy > border.max(1)
    }
}

/// How a surface's texture is filtered.
///
/// # Errors
/// Settings that are invalid, or `"auto"`, for which a filter must be chosen first.
pub fn filter(scene: &Scene, surface: &Surface) -> std::result::Result<Filter, SceneError> {
    let key = ["surface", &surface.name, "filter"];
    match surface.auto {
        Some(_) => Err(scene
            .fault(&key, "\"auto\" is chosen by `render` and `view`; name a filter here: { kind = ... }")),
        None => scene.read(&key),
    }
}

/// The scene with the filter [`Filter::ONE_SAMPLE`].
///
/// # Errors
/// An invalid scene.
pub fn with_one_sample(scene: &Scene) -> std::result::Result<Scene, SceneError> {
    with_filter(scene, "{max_anisotropy=1}")
}

fn with_filter(scene: &Scene, filter: &str) -> std::result::Result<Scene, SceneError> {
    match owner(scene)? {
        Some(surface) => scene.with(&[format!("surface.{}.filter={filter}", surface.name)]),
        None => Ok(scene.clone()),
    }
}

/// A shipped scene with the filter of paper 1: at most 16 trilinear samples along the footprint. The scene's own filter
/// is that of paper 3.
///
/// # Errors
/// No shipped scene has this name.
pub fn papers_scene(name: &str) -> std::result::Result<Scene, SceneError> {
    with_filter(&Scene::embedded(name)?, "{}")
}

/// A shipped scene with the filter [`Filter::ONE_SAMPLE`].
///
/// # Errors
/// No shipped scene has this name.
pub fn one_sample_scene(name: &str) -> std::result::Result<Scene, SceneError> {
    with_one_sample(&Scene::embedded(name)?)
}

/// Everything that a renderer needs besides the mesh and the texture.
#[derive(Clone, Debug)]
pub struct VirtualTextureSettings {
    /// Pixels.
    pub size: [u32; 2],
    pub config: Config,
    pub streaming: StreamingConfig,
    pub target: PixelFormat,
}

impl VirtualTextureSettings {
    /// The settings of a scene.
    ///
    /// # Errors
    /// An invalid section or filter.
    pub fn of_scene(
        scene: &Scene,
        target: PixelFormat,
    ) -> std::result::Result<VirtualTextureSettings, SceneError> {
        let mut config: Config = scene.read(&["variant"])?;
        let mut streaming: StreamingConfig = scene.read(&["cache"])?;
        if let Some(surface) = owner(scene)? {
            config.filter = filter(scene, surface)?;
        }
        config.fade_in_frames = streaming.fade_in_frames;
        streaming.level_bias = config.level_bias;
        Ok(VirtualTextureSettings { size: [scene.view.width, scene.view.height], config, streaming, target })
    }
}
