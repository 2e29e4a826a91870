//! The settings of a scene that trade time for accuracy, and which of them are combined.

use crate::figure::Refused;
use crate::paper::virtual_texture::choices::{Compaction, Dedup, Filtering, Listing, TileAddress};
use crate::paper::virtual_texture::config::{
    Config, Filter, MOST_SAMPLES, TextureError, TextureSource, VirtualTextureSettings, VirtualTextureSource,
    owner, texture,
};
use crate::picture::PixelFormat;
use crate::scene::{Choice, Scene, choices, unread_filter_keys};
use crate::texture::source::TileFormat;

choices! {
    /// A key of the scene, or several that belong together.
    pub enum Knob {
        /// Coarser levels than the footprint requests.
        LevelBias = "level-bias",
        /// The filter, and its number of samples.
        Filter = "filter",
        /// The largest number of samples along the footprint.
        Anisotropy = "anisotropy",
        /// Paper 3's filter: the largest ratio of the ellipse's axes, and the texels along its minor semi-axis.
        Ellipse = "ellipse",
        /// The width of the border around each tile.
        Border = "border",
        /// Feedback from some of the pixels instead of the exact list.
        List = "list",
        /// The exact fused draw instead of the scene's dedup and compaction.
        Stages = "stages",
        /// Tiles of half a byte per texel.
        Format = "format",
        /// Smaller tile pools.
        GpuTiles = "gpu-tiles",
        /// Budgets of uploading and loading. Measured separately, because budgets do not change a settled frame.
        Budgets = "budgets",
    }
}

/// A point of the sweep.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SweepPoint {
    /// The differences from the scene, in words.
    pub name: String,
    /// The differences from the scene, as `KEY=VALUE`.
    pub changes: Vec<String>,
}

impl Knob {
    /// The knobs that change only how a texture is filtered.
    pub const OF_FILTER: [Knob; 3] = [Knob::Filter, Knob::Anisotropy, Knob::Ellipse];

    /// The values `at`, then a copy of `at` for each value of the knob.
    fn turned(self, at: Values) -> Vec<Values> {
        let mut all = vec![at];
        match self {
            Knob::LevelBias => all.extend([0, 1, 2].map(|level_bias| Values { level_bias, ..at })),
            Knob::Filter => {
                // Only an ellipse has a ratio above the other filters' limit.
                let most = at.max_anisotropy.min(MOST_SAMPLES);
                // Bilinear samples and few taps are tried at the pixel's centre only, not along the footprint.
                let filters =
                    [(Filtering::Trilinear, at.samples, most), (Filtering::Bilinear, at.samples, 1)];
                let taps = [(1, 1), (4, 1), (16, most), (64, most)];
                let turned =
                    filters.into_iter().chain(taps.map(|(taps, na)| (Filtering::Stochastic, taps, na)));
                let published = [
                    (Filtering::Feline, at.samples, 4),
                    (Filtering::Feline, at.samples, 16),
                    (Filtering::Mavridis, at.samples, 4),
                    (Filtering::Pbrt, at.samples, most),
                    (Filtering::StochasticEllipse, 16, most),
                ];
                all.extend(turned.chain(published).map(|(filter, samples, max_anisotropy)| Values {
                    filter,
                    samples,
                    max_anisotropy,
                    ..at
                }));
            }
            Knob::Anisotropy => all.extend(RATIOS.map(|max_anisotropy| Values { max_anisotropy, ..at })),
            Knob::Ellipse => {
                let axes = [4, 16].into_iter().flat_map(|ratio| [1, 2, 4].map(|minor| (ratio, minor)));
                all.extend(axes.map(|(max_anisotropy, minor_texels)| Values {
                    filter: Filtering::Ellipse,
                    max_anisotropy,
                    minor_texels,
                    ..at
                }));
            }
            // A border costs memory and loading time. A border of 0 shows what the border is worth.
            Knob::Border => all.extend(BORDERS.map(|border| Values { border, ..at })),
            Knob::List => {
                let feedback = FEEDBACKS.map(|n| Values { list: Listing::Feedback, feedback_log2: n, ..at });
                all.extend(feedback);
            }
            // The exact fused draw.
            Knob::Stages => {
                all.push(Values {
                    stages: (Dedup::FusedExact, Compaction::FusedAppend, TileAddress::OwnLevel),
                    ..at
                });
            }
            Knob::Format => all.push(Values { format: TileFormat::Bc1, ..at }),
            // Fewer slots than visible tiles make the picture coarser.
            Knob::GpuTiles => {
                let fewer = [2, 4].map(|part| (at.gpu_tiles / part).max(1));
                all.extend(fewer.map(|gpu_tiles| Values { gpu_tiles, ..at }));
            }
            Knob::Budgets => {}
        }
        all
    }
}

/// Values of NA, the largest number of samples along a footprint.
const RATIOS: [u32; 5] = [1, 2, 4, 8, 16];
/// Borders in texels.
const BORDERS: [u32; 4] = [0, 1, 2, 8];
/// Values of n: one pixel in 2^n.
const FEEDBACKS: [u32; 4] = [2, 4, 6, 8];

/// The values of all knobs.
#[derive(Clone, Copy, PartialEq)]
struct Values {
    level_bias: u32,
    filter: Filtering,
    samples: u32,
    max_anisotropy: u32,
    minor_texels: u32,
    border: u32,
    list: Listing,
    feedback_log2: u32,
    stages: (Dedup, Compaction, TileAddress),
    format: TileFormat,
    /// Slots of the tile pool.
    gpu_tiles: u32,
}

impl Values {
    fn of(settings: &VirtualTextureSettings, texture: &VirtualTextureSource) -> Values {
        let Config { level_bias, list, feedback_log2, dedup, compact, address, filter, .. } = settings.config;
        let Filter { kind, max_anisotropy, minor_texels, samples, .. } = filter;
        Values {
            level_bias,
            filter: kind,
            samples,
            max_anisotropy,
            minor_texels,
            border: texture.border,
            list,
            feedback_log2,
            stages: (dedup, compact, address),
            format: texture.format,
            gpu_tiles: settings.streaming.gpu_tiles,
        }
    }

    /// The values with a sufficient border, or `None` if they are not to be measured. Samples along a footprint need a
    /// border of 2 texels, in small tiles one texel for each sample. A generated texture can have any
    /// border; a file's border is fixed.
    fn drawable(self, own: &Values, texture: &VirtualTextureSource) -> Option<Values> {
        if self == *own {
            return Some(self);
        }
        let sensible = match self.filter {
            Filtering::Trilinear => self.border > 0 || self.max_anisotropy == 1,
            // Trilinear samples along a footprint are better than bilinear ones.
            Filtering::Bilinear => self.max_anisotropy == 1,
            // Few taps along a long footprint show only noise. Taps need no border, so other borders are not tried with
            // them.
            Filtering::Stochastic => {
                (self.max_anisotropy == 1 || self.samples == 16) && self.border == own.border
            }
            // A filter of paper 3 that is not the scene's own is not combined with changes of other settings. Some of
            // these filters ignore max_anisotropy.
            filter => {
                let numbers = |of: &Values| [of.max_anisotropy, of.minor_texels, of.samples];
                let distinct = match filter {
                    Filtering::Feline => [4, 16].contains(&self.max_anisotropy),
                    Filtering::Mavridis => self.max_anisotropy == 4,
                    Filtering::Pbrt | Filtering::StochasticEllipse => {
                        self.max_anisotropy == own.max_anisotropy.min(MOST_SAMPLES)
                    }
                    _ => true,
                };
                let Values { filter, max_anisotropy, minor_texels, samples, .. } = *own;
                let alone = Values { filter, max_anisotropy, minor_texels, samples, ..self } == *own;
                (filter, numbers(own)) == (self.filter, numbers(&self)) || alone && distinct
            }
        };
        // Two kinds of values are not combined with other changes: subsampled lists, which delay the complete picture
        // but do not change it, and borders other than 0 and the scene's own.
        let (list, feedback_log2) = (own.list, own.feedback_log2);
        let listed = (self.list, self.feedback_log2) == (list, feedback_log2)
            || Values { list, feedback_log2, ..self } == *own;
        let bordered =
            [0, own.border].contains(&self.border) || Values { border: own.border, ..self } == *own;
        // Other filters than the stochastic ones ignore the number of samples.
        let sampled = self.filter.is_random() || self.samples == own.samples;
        // A list made on the host has no stages 2 and 3.
        let stages = self.list == Listing::Device || self.stages == own.stages;
        let filter = Filter { kind: self.filter, max_anisotropy: self.max_anisotropy, ..Filter::DEFAULT };
        let border = border_for(&filter, self.border, texture).ok()?;
        // Another format is tried with all filters but the stochastic one, at the scene's own bias, list and border,
        // and only if the border is a whole number of BC1 blocks. A smaller tile pool is not combined with other
        // changes.
        let format = self.format == own.format
            || (self.filter != Filtering::Stochastic
                && (self.level_bias, self.list, self.border) == (own.level_bias, own.list, own.border)
                && border.is_multiple_of(4));
        let fewer = self.gpu_tiles == own.gpu_tiles || Values { gpu_tiles: own.gpu_tiles, ..self } == *own;
        let alone = listed && bordered && fewer;
        (sensible && sampled && stages && format && alone).then_some(Values { border, ..self })
    }

    /// The setting with these values. `surface` is the key of the surface with the texture.
    fn setting(&self, own: &Values, surface: &str) -> SweepPoint {
        let (mut words, mut changes) = (Vec::new(), Vec::new());
        let mut differs = |is: bool, word: String, keys: &[String]| {
            if is {
                words.push(word);
                changes.extend_from_slice(keys);
            }
        };
        let taps = if self.filter.is_random() { format!(" {}", self.samples) } else { String::new() };
        let filter = self.filter.name();
        let mut keys =
            Vec::from_iter((self.filter != own.filter).then(|| format!("{surface}.filter.kind={filter}")));
        keys.extend(
            (self.samples != own.samples).then(|| format!("{surface}.filter.samples={}", self.samples)),
        );
        differs(!keys.is_empty(), format!("{filter}{taps}"), &keys);
        let minor = self.minor_texels;
        differs(
            minor != own.minor_texels,
            format!("minor {minor}"),
            &[format!("{surface}.filter.minor_texels={minor}")],
        );
        let [na, border, bias] = [self.max_anisotropy, self.border, self.level_bias];
        // Another kind starts from the scene's own number, or from the default if the scene's kind does not read it.
        let reads = unread_filter_keys(filter).all(|(key, _)| key != "max_anisotropy");
        differs(
            na != own.max_anisotropy && reads,
            format!("NA {na}"),
            &[format!("{surface}.filter.max_anisotropy={na}")],
        );
        differs(
            border != own.border,
            format!("border {border}"),
            &[format!("{surface}.texture.border={border}")],
        );
        differs(bias != own.level_bias, format!("bias {bias}"), &[format!("variant.level_bias={bias}")]);
        let n = self.feedback_log2;
        let list = [format!("variant.list={}", self.list.name()), format!("variant.feedback_log2={n}")];
        let another = (self.list, n) != (own.list, own.feedback_log2);
        differs(another, format!("{} 1/{}", self.list.name(), 1 << n), &list);
        let (dedup, compact, address) = self.stages;
        let stages = [
            format!("variant.dedup={}", dedup.name()),
            format!("variant.compact={}", compact.name()),
            format!("variant.address={}", address.name()),
        ];
        differs(self.stages != own.stages, dedup.name().to_string(), &stages);
        let format = self.format.name();
        differs(
            self.format != own.format,
            format.to_string(),
            &[format!("{surface}.texture.format={format}")],
        );
        let n1 = self.gpu_tiles;
        differs(n1 != own.gpu_tiles, format!("N1 {n1}"), &[format!("cache.gpu_tiles={n1}")]);
        let name = if words.is_empty() { "the scene's own".to_string() } else { words.join(", ") };
        SweepPoint { name, changes }
    }
}

/// The first border that suffices for the filter and that the texture can have; `border` is tried first. The error
/// says why there is none.
fn border_for(filter: &Filter, border: u32, texture: &VirtualTextureSource) -> Result<u32, String> {
    let fault = |border| {
        let pyramid = VirtualTextureSource { border, ..texture.clone() }.pyramid();
        let beyond = filter.beyond(border, texture.tile_size).map(|(_, why)| why);
        beyond.or_else(|| pyramid.err().map(|error| error.to_string()))
    };
    let others = match texture.source {
        TextureSource::File => Vec::new(),
        _ => vec![filter.least_border(), filter.max_anisotropy],
    };
    others.into_iter().fold(fault(border).map_or(Ok(border), Err), |found, other| {
        found.or_else(|_| fault(other).map_or(Ok(other), Err))
    })
}

/// The key of the surface with the scene's virtual texture.
///
/// # Errors
/// A scene without one.
pub(super) fn surface(scene: &Scene) -> Result<String, TextureError> {
    let surface = owner(scene)?.ok_or_else(|| TextureError::Absent(scene.name.clone()))?;
    Ok(format!("surface.{}", surface.name))
}

/// All settings of `knobs` for a scene: its own first, then those that change the fewest keys.
///
/// # Errors
/// A scene without a virtual texture.
pub fn settings(scene: &Scene, knobs: &[Knob]) -> Result<Vec<SweepPoint>, TextureError> {
    let (texture, surface) = (texture(scene)?, surface(scene)?);
    let own = Values::of(&VirtualTextureSettings::of_scene(scene, PixelFormat::Srgb8)?, &texture);
    let generated = texture.source != TextureSource::File;
    let mut all = vec![own];
    for knob in Knob::ALL.iter().filter(|knob| knobs.contains(knob)) {
        let generates = match knob {
            Knob::Border => generated,
            // The ruler's texels must be exact, and bc1 is lossy.
            Knob::Format => matches!(texture.source, TextureSource::Earth | TextureSource::Terrain),
            _ => true,
        };
        if !generates {
            continue;
        }
        all = all.into_iter().flat_map(|values| knob.turned(values)).collect();
    }
    let drawable = all.into_iter().filter_map(|values| values.drawable(&own, &texture));
    let mut settings: Vec<SweepPoint> = Vec::new();
    for setting in drawable.map(|values| values.setting(&own, &surface)) {
        if !settings.contains(&setting) {
            settings.push(setting);
        }
    }
    settings.sort_by_key(|setting| setting.changes.len());
    Ok(settings)
}

/// The values of `knobs` that this scene does not support, each with the reason and a remedy.
///
/// # Errors
/// A scene without a virtual texture.
pub fn not_turned(scene: &Scene, knobs: &[Knob]) -> Result<Vec<Refused>, TextureError> {
    let (texture, surface) = (texture(scene)?, surface(scene)?);
    let filter = VirtualTextureSettings::of_scene(scene, PixelFormat::Srgb8)?.config.filter;
    let own = texture.border;
    let baked = texture.source == TextureSource::File;
    let mut refused = Vec::new();
    let mut refuse = |name: String, why: String| refused.push(Refused { name, why });
    if knobs.contains(&Knob::Border) {
        for border in BORDERS.into_iter().filter(|border| *border != own) {
            if baked {
                let why =
                    format!("the file has a border of {own} texels; bake it again with --border {border}");
                refuse(format!("border {border}"), why);
            } else if let Some((key, why)) = filter.beyond(border, texture.tile_size) {
                refuse(format!("border {border}"), format!("the scene's {surface}.filter.{key}: {why}"));
            }
        }
    }
    if knobs.contains(&Knob::Anisotropy) {
        for max_anisotropy in RATIOS {
            let filter = Filter { max_anisotropy, ..filter };
            let Err(why) = border_for(&filter, own, &texture) else { continue };
            let remedy = if baked { ": bake it again with --border 2" } else { "" };
            refuse(format!("NA {max_anisotropy}"), format!("{why}{remedy}"));
        }
    }
    if knobs.contains(&Knob::Format) && texture.format != TileFormat::Bc1 {
        match texture.source {
            TextureSource::Earth | TextureSource::Terrain => {}
            TextureSource::File => {
                refuse(
                    "bc1".into(),
                    "the file was baked in another format; bake it again with --format bc1".into(),
                );
            }
            TextureSource::Ruler => {
                refuse("bc1".into(), "the ruler's texels are exact, and bc1 is lossy".into())
            }
        }
    }
    Ok(refused)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::virtual_texture::config::{one_sample_scene, papers_scene};

    fn baked(scene: &Scene) -> Scene {
        let changes = ["path=a.tiles", "source=file"].map(|change| format!("surface.land.texture.{change}"));
        scene.with(&changes).unwrap()
    }

    #[test]
    fn the_scenes_own_setting_comes_first_and_all_others_are_valid_scenes() {
        let scenes =
            ["earth", "plane"].map(|name| [Scene::embedded(name).unwrap(), papers_scene(name).unwrap()]);
        for scene in scenes.iter().flatten() {
            let all = settings(scene, Knob::ALL).unwrap();
            assert_eq!((all[0].name.as_str(), all[0].changes.len()), ("the scene's own", 0));
            assert!((40..200).contains(&all.len()), "{}", all.len());
            let mut names: Vec<&str> = all.iter().map(|setting| setting.name.as_str()).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), all.len(), "each name once");
            for setting in &all[1..] {
                let changed = scene.with(&setting.changes).unwrap();
                assert_ne!(&changed, scene, "{}", setting.name);
                texture(&changed).unwrap();
            }
        }
    }

    #[test]
    fn the_earth_also_tries_bc1_and_fewer_tiles_are_tried_alone() {
        let scene = one_sample_scene("earth").unwrap();
        let names = |knobs: &[Knob]| {
            settings(&scene, knobs).unwrap().into_iter().map(|setting| setting.name).collect::<Vec<_>>()
        };
        assert_eq!(names(&[Knob::Format, Knob::GpuTiles]), ["the scene's own", "N1 96", "N1 48", "bc1"]);
        assert_eq!(names(&[Knob::Budgets]), ["the scene's own"]);
        assert!(!names(&[Knob::Format, Knob::Border]).contains(&"border 0, bc1".to_string()));
        let ruler = Scene::embedded("ruler").unwrap();
        assert_eq!(settings(&ruler, &[Knob::Format]).unwrap().len(), 1);
        let terrain = Scene::embedded("valley").unwrap();
        let all = settings(&terrain, &[Knob::Format]).unwrap();
        assert_eq!(all.iter().map(|setting| &*setting.name).collect::<Vec<_>>(), ["the scene's own", "bc1"]);
        let of_format = |scene: &Scene| not_turned(scene, &[Knob::Format]).unwrap().len();
        assert_eq!([&scene, &terrain, &ruler].map(of_format), [0, 0, 1]);
    }

    #[test]
    fn subsampled_lists_and_odd_borders_are_tried_alone() {
        let scene = one_sample_scene("earth").unwrap();
        let names = |knobs: &[Knob]| {
            settings(&scene, knobs).unwrap().into_iter().map(|setting| setting.name).collect::<Vec<_>>()
        };
        let lists = ["feedback 1/4", "feedback 1/16", "feedback 1/64", "feedback 1/256"];
        assert_eq!(names(&[Knob::List])[1..], lists);
        assert_eq!(names(&[Knob::Border])[1..], ["border 0", "border 1", "border 2", "border 8"]);
        let all = names(&[Knob::List, Knob::Border, Knob::LevelBias]);
        assert_eq!(
            all.iter().filter(|name| name.contains(", ")).collect::<Vec<_>>(),
            ["border 0, bias 1", "border 0, bias 2"]
        );
    }

    #[test]
    fn unsupported_values_are_reported_with_a_remedy() {
        let scene = one_sample_scene("earth").unwrap();
        assert_eq!(not_turned(&scene, Knob::ALL).unwrap().len(), 0);
        let scene = scene.with(&["surface.land.filter.max_anisotropy=4".into()]).unwrap();
        let reported = |scene: &Scene| -> Vec<String> {
            let refused = not_turned(scene, Knob::ALL).unwrap();
            refused.into_iter().map(|refused| format!("{}: {}", refused.name, refused.why)).collect()
        };
        assert_eq!(reported(&scene).len(), 2, "{:?}", reported(&scene));
        let lines = reported(&baked(&scene));
        assert_eq!(lines.len(), 5, "{lines:?}");
        assert_eq!(lines[1], "border 1: the file has a border of 4 texels; bake it again with --border 1");
        assert!(lines[4].ends_with("--format bc1"), "{lines:?}");
    }

    #[test]
    fn a_generated_source_gets_the_border_that_the_samples_need() {
        let scene = one_sample_scene("plane").unwrap();
        let all = settings(&scene, &[Knob::Anisotropy]).unwrap();
        let changes: Vec<String> = all.iter().map(|setting| setting.changes.join(" ")).collect();
        assert_eq!(
            changes,
            [
                "",
                "surface.land.filter.max_anisotropy=2",
                "surface.land.filter.max_anisotropy=4",
                "surface.land.filter.max_anisotropy=8",
                "surface.land.filter.max_anisotropy=16"
            ]
        );
        let scene = scene.with(&["surface.land.texture.border=1".into()]).unwrap();
        let all = settings(&scene, &[Knob::Anisotropy]).unwrap();
        assert_eq!(
            all[1].changes,
            ["surface.land.filter.max_anisotropy=2", "surface.land.texture.border=2"],
            "{}",
            all[1].name
        );
        assert_eq!(settings(&scene, &[]).unwrap().len(), 1);
        // In tiles of 16 texels, 16 samples reach further than half a tile. They would need a border of 16 texels,
        // which is too wide for such a tile. In tiles of 32 texels, a border of 2 suffices.
        let of = |tile: u32| scene.with(&[format!("surface.land.texture.tile_size={tile}")]).unwrap();
        let last = |tile| settings(&of(tile), &[Knob::Anisotropy]).unwrap().pop().unwrap();
        assert_eq!((last(16).name.as_str(), last(32).name.as_str()), ("NA 8, border 2", "NA 16, border 2"));
        let refused = not_turned(&of(16), &[Knob::Anisotropy]).unwrap();
        let refused: Vec<_> = refused.iter().map(|one| format!("{}: {}", one.name, one.why)).collect();
        assert_eq!(refused, ["NA 16: a border of 16 texels is wider than half a tile"]);
    }

    #[test]
    fn the_ellipse_is_tried_alone() {
        let names = |scene: &Scene, knobs: &[Knob]| -> Vec<String> {
            settings(scene, knobs).unwrap().into_iter().map(|setting| setting.name).collect()
        };
        let scene = one_sample_scene("earth").unwrap();
        let ellipses = |names: &[String]| names.iter().filter(|name| name.starts_with("ellipse")).count();
        let all = names(&scene, &Knob::OF_FILTER);
        assert_eq!((all.len(), ellipses(&all)), (25, 6), "{all:?}");
        let published = ["feline, NA 4", "feline, NA 16", "mavridis, NA 4", "pbrt", "stochastic-ellipse 16"];
        assert!(published.iter().all(|name| all.contains(&(*name).to_owned())), "{all:?}");
        assert!(
            all.contains(&"ellipse, minor 1, NA 16".into()) && all.contains(&"ellipse, NA 4".into()),
            "{all:?}"
        );
        assert_eq!(ellipses(&names(&scene, Knob::ALL)), 6);
        let own = scene.with(&["surface.land.filter.kind=ellipse".into()]).unwrap();
        assert!(names(&own, &[Knob::LevelBias]).contains(&"bias 1".into()), "of the scene's own ellipse");
    }
}
