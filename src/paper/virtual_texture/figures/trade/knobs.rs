//! What can be turned on a scene to trade time for accuracy, and which turns go together.

use crate::figure::Refused;
use crate::paper::virtual_texture::choices::{Compaction, Dedup, Filtering, Keying, Listing};
use crate::paper::virtual_texture::config::{
    Config, Filter, Settings, Texture, TextureError, TextureSource, owner, texture,
};
use crate::picture::Target;
use crate::scene::{Choice, Scene};
use crate::texture::source::TileFormat;

/// A key of the scene, or several that go together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knob {
    LevelBias,
    Filter,
    Anisotropy,
    Border,
    List,
    Stages,
    Format,
    GpuTiles,
    /// Turned apart (`super::budgets`): no budget changes a settled frame.
    Budgets,
}

/// A point of the sweep.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// What differs from the scene, in words.
    pub name: String,
    /// The same as changes `KEY=VALUE` of the scene.
    pub changes: Vec<String>,
}

impl Knob {
    pub const ALL: [Knob; 9] = [
        Knob::LevelBias,
        Knob::Filter,
        Knob::Anisotropy,
        Knob::Border,
        Knob::List,
        Knob::Stages,
        Knob::Format,
        Knob::GpuTiles,
        Knob::Budgets,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Knob::LevelBias => "level-bias",
            Knob::Filter => "filter",
            Knob::Anisotropy => "anisotropy",
            Knob::Border => "border",
            Knob::List => "list",
            Knob::Stages => "stages",
            Knob::Format => "format",
            Knob::GpuTiles => "gpu-tiles",
            Knob::Budgets => "budgets",
        }
    }

    /// `at`, and where the knob can stand otherwise.
    fn turned(self, at: Values) -> Vec<Values> {
        let mut all = vec![at];
        match self {
            Knob::LevelBias => all.extend([0, 1, 2].map(|level_bias| Values { level_bias, ..at })),
            Knob::Filter => {
                let filters = [(Filtering::Trilinear, at.samples), (Filtering::Bilinear, at.samples)];
                let taps = [1, 4, 16].map(|taps| (Filtering::Stochastic, taps));
                let turned = filters.into_iter().chain(taps);
                all.extend(turned.map(|(filter, samples)| Values { filter, samples, ..at }));
            }
            Knob::Anisotropy => {
                all.extend([1, 2, 4, 8].map(|max_anisotropy| Values { max_anisotropy, ..at }));
            }
            // A border costs memory and reading; 0 shows what one is worth.
            Knob::Border => all.extend(BORDERS.map(|border| Values { border, ..at })),
            Knob::List => {
                let feedback = FEEDBACKS.map(|n| Values { list: Listing::Feedback, feedback_log2: n, ..at });
                all.extend(feedback);
            }
            // The draw that does it all, exactly.
            Knob::Stages => {
                all.push(Values {
                    stages: (Dedup::FusedExact, Compaction::FusedAppend, Keying::Native),
                    ..at
                });
            }
            Knob::Format => all.push(Values { format: TileFormat::Bc1, ..at }),
            // Less than the visible tiles makes the picture coarser.
            Knob::GpuTiles => {
                let fewer = [2, 4].map(|part| (at.gpu_tiles / part).max(1));
                all.extend(fewer.map(|gpu_tiles| Values { gpu_tiles, ..at }));
            }
            Knob::Budgets => {}
        }
        all
    }
}

/// Texels.
const BORDERS: [u32; 4] = [0, 1, 2, 8];
/// n: one pixel of 2^n.
const FEEDBACKS: [u32; 4] = [2, 4, 6, 8];

/// Where all knobs stand.
#[derive(Clone, Copy, PartialEq)]
struct Values {
    level_bias: u32,
    filter: Filtering,
    samples: u32,
    max_anisotropy: u32,
    border: u32,
    list: Listing,
    feedback_log2: u32,
    stages: (Dedup, Compaction, Keying),
    format: TileFormat,
    /// N1.
    gpu_tiles: u32,
}

impl Values {
    fn of(settings: &Settings, texture: &Texture) -> Values {
        let Config { level_bias, list, feedback_log2, dedup, compact, keying, filter, .. } = settings.config;
        let Filter { kind, max_anisotropy, samples, .. } = filter;
        Values {
            level_bias,
            filter: kind,
            samples,
            max_anisotropy,
            border: texture.border,
            list,
            feedback_log2,
            stages: (dedup, compact, keying),
            format: texture.format,
            gpu_tiles: settings.streaming.gpu_tiles,
        }
    }

    /// As it can be drawn, or none: samples reach as far over a tile's edge as there are, which takes a border; what is
    /// generated can have it, a file has what it has.
    fn drawable(self, own: &Values, generated: bool) -> Option<Values> {
        if self == *own {
            return Some(self);
        }
        let sensible = match self.filter {
            Filtering::Trilinear => self.border > 0 || self.max_anisotropy == 1,
            // Samples along a footprint that each take one level are what trilinear ones are better at.
            Filtering::Bilinear => self.max_anisotropy == 1,
            // Few taps along a long footprint show noise alone; their tiles need no border at all.
            Filtering::Stochastic => {
                (self.max_anisotropy == 1 || self.samples == 16) && self.border == own.border
            }
        };
        // Subsampled lists change when a picture is whole and not what it is, and some borders are between those that
        // stand beside all else: both alone.
        let (list, feedback_log2) = (own.list, own.feedback_log2);
        let listed = (self.list, self.feedback_log2) == (list, feedback_log2)
            || Values { list, feedback_log2, ..self } == *own;
        let bordered =
            [0, own.border].contains(&self.border) || Values { border: own.border, ..self } == *own;
        // A list of the host's has no stages 2 and 3.
        let stages = self.list == Listing::Device || self.stages == own.stages;
        let reach = if self.filter == Filtering::Stochastic { 0 } else { self.max_anisotropy };
        let fits = reach <= 1 || reach <= self.border;
        let border = if fits { self.border } else { reach };
        // Another format stands beside the filters that sample, blocks cut by no border; fewer tiles beside nothing else.
        let format = self.format == own.format
            || (self.filter != Filtering::Stochastic
                && (self.level_bias, self.list, self.border) == (own.level_bias, own.list, own.border)
                && border.is_multiple_of(4));
        let fewer = self.gpu_tiles == own.gpu_tiles || Values { gpu_tiles: own.gpu_tiles, ..self } == *own;
        let alone = listed && bordered && fewer;
        (sensible && stages && format && alone && (fits || generated)).then_some(Values { border, ..self })
    }

    /// `surface` is the key of the surface with the texture.
    fn setting(&self, own: &Values, surface: &str) -> Setting {
        let (mut words, mut changes) = (Vec::new(), Vec::new());
        let mut differs = |is: bool, word: String, keys: &[String]| {
            if is {
                words.push(word);
                changes.extend_from_slice(keys);
            }
        };
        let stochastic = self.filter == Filtering::Stochastic;
        let taps = if stochastic { format!(" {}", self.samples) } else { String::new() };
        let filter = self.filter.name();
        let mut keys =
            Vec::from_iter((self.filter != own.filter).then(|| format!("{surface}.filter.kind={filter}")));
        keys.extend(
            (self.samples != own.samples).then(|| format!("{surface}.filter.samples={}", self.samples)),
        );
        differs(!keys.is_empty(), format!("{filter}{taps}"), &keys);
        let [na, border, bias] = [self.max_anisotropy, self.border, self.level_bias];
        differs(
            na != own.max_anisotropy,
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
        let (dedup, compact, keying) = self.stages;
        let stages = [
            format!("variant.dedup={}", dedup.name()),
            format!("variant.compact={}", compact.name()),
            format!("variant.keying={}", keying.name()),
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
        Setting { name, changes }
    }
}

/// The key of the surface with the scene's virtual texture.
///
/// # Errors
/// A scene without one.
pub(super) fn surface(scene: &Scene) -> Result<String, TextureError> {
    let surface = owner(scene)?.ok_or_else(|| TextureError::Absent(scene.name.clone()))?;
    Ok(format!("surface.{}", surface.name))
}

/// All settings that `knobs` give a scene, its own first, then those that change the fewest keys.
///
/// # Errors
/// A scene without a virtual texture.
pub fn settings(scene: &Scene, knobs: &[Knob]) -> Result<Vec<Setting>, TextureError> {
    let (texture, surface) = (texture(scene)?, surface(scene)?);
    let own = Values::of(&Settings::of_scene(scene, Target::Srgb8)?, &texture);
    let generated = texture.source != TextureSource::File;
    let mut all = vec![own];
    for knob in Knob::ALL.into_iter().filter(|knob| knobs.contains(knob)) {
        let generates = match knob {
            Knob::Border => generated,
            // The ruler is exact, which bc1 is not.
            Knob::Format => texture.source == TextureSource::Earth,
            _ => true,
        };
        if !generates {
            continue;
        }
        all = all.into_iter().flat_map(|values| knob.turned(values)).collect();
    }
    let drawable = all.into_iter().filter_map(|values| values.drawable(&own, generated));
    let mut settings: Vec<Setting> = Vec::new();
    for setting in drawable.map(|values| values.setting(&own, &surface)) {
        if !settings.contains(&setting) {
            settings.push(setting);
        }
    }
    settings.sort_by_key(|setting| setting.changes.len());
    Ok(settings)
}

/// What `knobs` do not turn in this scene, why, and what would.
///
/// # Errors
/// A scene without a virtual texture.
pub fn not_turned(scene: &Scene, knobs: &[Knob]) -> Result<Vec<Refused>, TextureError> {
    let (texture, surface) = (texture(scene)?, surface(scene)?);
    let filter = Settings::of_scene(scene, Target::Srgb8)?.config.filter;
    let own = texture.border;
    let baked = texture.source == TextureSource::File;
    let mut refused = Vec::new();
    let mut refuse = |name: String, why: String| refused.push(Refused { name, why });
    if knobs.contains(&Knob::Border) {
        let (reach, stochastic) = (filter.max_anisotropy, filter.kind == Filtering::Stochastic);
        for border in BORDERS.into_iter().filter(|border| *border != own) {
            if baked {
                let why =
                    format!("the file has a border of {own} texels; bake it again with --border {border}");
                refuse(format!("border {border}"), why);
            } else if !stochastic && reach > 1 && reach > border {
                let why = format!(
                    "the scene's {surface}.filter.max_anisotropy = {reach} samples {reach} texels over a tile's edge"
                );
                refuse(format!("border {border}"), why);
            }
        }
    }
    if knobs.contains(&Knob::Anisotropy) && baked {
        for na in [2, 4, 8].into_iter().filter(|na| *na > own) {
            let why = format!("the file has a border of {own} texels; bake it again with --border {na}");
            refuse(format!("NA {na}"), why);
        }
    }
    if knobs.contains(&Knob::Format) && texture.format != TileFormat::Bc1 {
        match texture.source {
            TextureSource::Earth => {}
            TextureSource::File => {
                refuse(
                    "bc1".into(),
                    "a file has the format that it was baked with; bake it again with --format bc1".into(),
                );
            }
            _ => refuse("bc1".into(), "the ruler's texels are exact, which bc1 is not".into()),
        }
    }
    Ok(refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn baked(scene: &Scene) -> Scene {
        let changes = ["path=a.tiles", "source=file"].map(|change| format!("surface.land.texture.{change}"));
        scene.with(&changes).unwrap()
    }

    #[test]
    fn the_scenes_own_setting_comes_first_and_each_other_is_a_scene() {
        for name in ["earth", "plane"] {
            let scene = Scene::embedded(name).unwrap();
            let all = settings(&scene, &Knob::ALL).unwrap();
            assert_eq!((all[0].name.as_str(), all[0].changes.len()), ("the scene's own", 0));
            assert!((40..200).contains(&all.len()), "{}", all.len());
            let mut names: Vec<&str> = all.iter().map(|setting| setting.name.as_str()).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), all.len(), "each name once");
            for setting in &all[1..] {
                let changed = Scene::load_with(name, &setting.changes).unwrap();
                assert_ne!(changed, scene, "{}", setting.name);
            }
        }
    }

    #[test]
    fn another_format_is_the_earths_and_fewer_tiles_stand_alone() {
        let scene = Scene::embedded("earth").unwrap();
        let names = |knobs: &[Knob]| {
            settings(&scene, knobs).unwrap().into_iter().map(|setting| setting.name).collect::<Vec<_>>()
        };
        assert_eq!(names(&[Knob::Format, Knob::GpuTiles]), ["the scene's own", "N1 96", "N1 48", "bc1"]);
        assert_eq!(names(&[Knob::Budgets]), ["the scene's own"]);
        assert!(!names(&[Knob::Format, Knob::Border]).contains(&"border 0, bc1".to_string()));
        let ruler = Scene::embedded("ruler").unwrap();
        assert_eq!(settings(&ruler, &[Knob::Format]).unwrap().len(), 1);
    }

    #[test]
    fn subsampled_lists_and_odd_borders_stand_alone() {
        let scene = Scene::embedded("earth").unwrap();
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
    fn what_is_not_turned_is_told_with_what_would() {
        let scene = Scene::embedded("earth").unwrap();
        assert_eq!(not_turned(&scene, &Knob::ALL).unwrap().len(), 0);
        let scene = scene.with(&["surface.land.filter.max_anisotropy=4".into()]).unwrap();
        let told = |scene: &Scene| -> Vec<String> {
            let refused = not_turned(scene, &Knob::ALL).unwrap();
            refused.into_iter().map(|refused| format!("{}: {}", refused.name, refused.why)).collect()
        };
        assert_eq!(told(&scene).len(), 3, "{:?}", told(&scene));
        let lines = told(&baked(&scene));
        assert_eq!(lines.len(), 6, "{lines:?}");
        assert_eq!(lines[1], "border 1: the file has a border of 4 texels; bake it again with --border 1");
        assert!(lines[4].starts_with("NA 8: ") && lines[5].ends_with("--format bc1"), "{lines:?}");
    }

    #[test]
    fn a_border_follows_the_samples_where_the_source_is_generated() {
        let scene = Scene::embedded("plane").unwrap();
        let all = settings(&scene, &[Knob::Anisotropy]).unwrap();
        let changes: Vec<String> = all.iter().map(|setting| setting.changes.join(" ")).collect();
        assert_eq!(
            changes,
            [
                "",
                "surface.land.filter.max_anisotropy=2",
                "surface.land.filter.max_anisotropy=4",
                "surface.land.filter.max_anisotropy=8 surface.land.texture.border=8"
            ]
        );
        assert_eq!(settings(&baked(&scene), &[Knob::Anisotropy, Knob::Border]).unwrap().len(), 3);
        assert_eq!(settings(&scene, &[]).unwrap().len(), 1);
    }
}
