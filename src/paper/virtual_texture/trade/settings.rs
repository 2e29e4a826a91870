//! The settings of a scene that trade time for accuracy.

use super::knobs::{BORDERS, Knob, RATIOS};
use super::values::{SweepPoint, Values, border_for};
use crate::figure::Refused;
use crate::paper::virtual_texture::config::{
    Filter, TextureError, TextureSource, VirtualTextureSettings, owner, texture,
};
use crate::picture::PixelFormat;
use crate::scene::Scene;
use crate::texture::source::TileFormat;

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
            } else if let Some((key, why)) = filter.tile_fault(border, texture.tile_size) {
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
        assert_eq!((all.len(), ellipses(&all)), (33, 14), "{all:?}");
        let published = ["feline, NA 4", "feline, NA 16", "mavridis, NA 4", "pbrt", "stochastic-ellipse 16"];
        assert!(published.iter().all(|name| all.contains(&(*name).to_owned())), "{all:?}");
        assert!(
            all.contains(&"ellipse, minor 1, edge none, NA 16".into())
                && all.contains(&"ellipse, NA 4".into()),
            "{all:?}"
        );
        assert_eq!(ellipses(&names(&scene, Knob::ALL)), 14);
        let own = scene.with(&["surface.land.filter.kind=ellipse".into()]).unwrap();
        assert!(names(&own, &[Knob::LevelBias]).contains(&"bias 1".into()), "of the scene's own ellipse");
    }

    #[test]
    fn a_weight_map_is_tried_with_the_scenes_own_ellipse_and_with_long_ones() {
        let names = |scene: &Scene, knobs: &[Knob]| -> Vec<String> {
            settings(scene, knobs).unwrap().into_iter().map(|setting| setting.name).collect()
        };
        let globe = Scene::embedded("globe").unwrap();
        let maps = ["radial map", "squared-radius map"];
        assert_eq!(names(&globe, &[Knob::WeightMap])[1..], maps);
        let all = names(&globe, Knob::ALL);
        assert_eq!(all.iter().filter(|name| name.contains(" map")).count(), 2, "{all:?}");
        let papers = names(&papers_scene("globe").unwrap(), &Knob::OF_FILTER);
        let of = |name: &&String| name.starts_with("ellipse") && name.ends_with(" map");
        assert_eq!(papers.iter().filter(of).count(), 6, "{papers:?}");
        assert!(papers.contains(&"ellipse, minor 1, radial map".into()), "{papers:?}");
        let map = ["weight_map=radial", "map_entries=16"];
        let map = map.map(|change| format!("surface.land.filter.{change}"));
        let map = globe.with(&map).unwrap();
        let without = settings(&map, &[Knob::WeightMap]).unwrap().remove(1);
        assert_eq!(without.name, "no map");
        VirtualTextureSettings::of_scene(&map.with(&without.changes).unwrap(), PixelFormat::Srgb8).unwrap();
    }
}
