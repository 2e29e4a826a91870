//! The variants that Space reaches: the variants given with `--variant`, or else the scene's own variant and the other
//! variants of its paper.

use super::filters::other_filters;
use ortelius::paper::virtual_texture::choices::{Compaction, Dedup};
use ortelius::paper::virtual_texture::{MaskLayout, PAPER};
use ortelius::renderer::sections::{self, LANGUAGES};
use ortelius::scene::{self, Scene, ValueKind};

/// A named set of overrides.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    pub name: String,
    /// In the syntax of `-D`, as KEY=VALUE.
    pub changes: Vec<String>,
}

/// The scene's own variant, then other filters of a virtual texture, which change the picture. If the scene's own
/// filter is the ellipse: the weight maps that can replace its Gaussian. Then one variant for each other value of the
/// settings that its paper compares. For a virtual texture: how visible tiles are listed. For a progressive mesh: which
/// processor changes the level of detail, and the order of faces. For a relief: its method. For a plain texture: its
/// filter.
pub fn own_variants(scene: &Scene) -> Vec<Variant> {
    let own = Variant { name: "the scene's own".to_owned(), changes: Vec::new() };
    let filters =
        other_filters(scene).map(|(name, change)| Variant { name: name.to_owned(), changes: vec![change] });
    let maps = weight_map(scene).into_iter().flat_map(|keys| other_values(scene, &keys, false));
    let others = compared(scene).into_iter().enumerate();
    let others = others.flat_map(|(n, keys)| other_values(scene, &keys, n == 0));
    std::iter::once(own).chain(filters).chain(maps).chain(others).collect()
}

/// The key of the weight map, for the first surface with a filter of its own that reads it.
fn weight_map(scene: &Scene) -> Option<[String; 2]> {
    let is_ellipse = |name: &&String| scene.word(&["surface", name, "filter", "kind"]) == Some("ellipse");
    let name = scene.surfaces.keys().find(is_ellipse)?;
    Some(["NAME", name].map(|name| format!("surface.{name}.filter.weight_map")))
}

/// The settings that the scene's paper compares, as pairs of keys: the declared key, and the key with the name of this
/// scene's surface.
fn compared(scene: &Scene) -> Vec<[String; 2]> {
    let is_virtual = |surface: &scene::Surface| scene.texture_kind(surface) == Some("virtual");
    if scene.surfaces.values().any(is_virtual) {
        return ["dedup", "compact", "list", "request_draw"]
            .map(|key| [(); 2].map(|()| format!("variant.{key}")))
            .into();
    }
    let is_mesh =
        |name: &&String| scene.word(&["surface", name, "geometry", "kind"]) == Some("progressive-mesh");
    let has_relief = |name: &&String| scene.word(&["surface", name, "relief", "map"]).is_some();
    let names = || scene.surfaces.keys();
    let of_surface = [
        (names().find(is_mesh), &["geometry.apply", "geometry.order"][..]),
        (names().find(has_relief), &["relief.method"]),
        (names().next(), &["filter.kind"]),
    ];
    let found = of_surface.into_iter().find_map(|(name, keys)| Some((name?, keys)));
    let keys = found.into_iter().flat_map(|(name, keys)| keys.iter().map(move |key| (name, key)));
    keys.map(|(name, key)| ["NAME", name].map(|name| format!("surface.{name}.{key}"))).collect()
}

/// A variant for each other value of a setting that the scene allows. For the first setting, the variant has the name
/// of the value; for the other settings, the name of the setting precedes the value.
fn other_values(scene: &Scene, [declared, key]: &[String; 2], is_first: bool) -> Vec<Variant> {
    let keys = scene::keys(LANGUAGES);
    let declared = keys.iter().find(|at| at.dotted == *declared).expect("the setting is declared");
    let ValueKind::Choice(values) = &declared.key.kind else { return Vec::new() };
    let path: Vec<&str> = key.split('.').collect();
    let default = declared.key.default.as_ref().and_then(|default| default.as_str());
    let now = scene.word(&path).or(default);
    let short = path.last().expect("a key has a name");
    let variant = |value: &str| {
        let mut changes = vec![format!("{key}={value}")];
        changes.extend(companions(scene, short, value)?.into_iter().map(str::to_owned));
        let name = if is_first { value.to_owned() } else { format!("{short}: {value}") };
        Some(Variant { name, changes })
    };
    let is_valid =
        |variant: &Variant| scene.with(&variant.changes).is_ok_and(|scene| sections::check(&scene).is_ok());
    let others = values.iter().filter(|(value, _)| Some(*value) != now);
    others.filter_map(|(value, _)| variant(value)).filter(is_valid).collect()
}

/// The changes that make a value fit the scene's other settings; `None` if no change does.
fn companions(scene: &Scene, key: &str, value: &str) -> Option<Vec<&'static str>> {
    let of_scene = |key, default| scene.word(&["variant", key]).unwrap_or(default);
    let dedup = |name: &str| Dedup::ALL.iter().find(|dedup| dedup.name() == name);
    // The geometry shader of stage 3 reads the tile mask only as texels.
    let feeds_back = |compact: &str| compact == Compaction::TransformFeedback.name();
    let marks_texels = |dedup: &Dedup| dedup.layout() == MaskLayout::Texels;
    let now = dedup(of_scene("dedup", PAPER.dedup.name()))?;
    match key {
        "dedup" => {
            let dedup = dedup(value)?;
            let computes = !marks_texels(dedup) && feeds_back(of_scene("compact", PAPER.compact.name()));
            let own_level = *dedup == Dedup::Bitset;
            let changes = [(computes, "variant.compact=append"), (own_level, "variant.address=own-level")];
            Some(changes.into_iter().filter_map(|(needed, change)| needed.then_some(change)).collect())
        }
        "compact" if feeds_back(value) => marks_texels(now).then(Vec::new),
        "compact" if value == Compaction::FusedAppend.name() && !now.fused() => {
            Some(vec!["variant.dedup=fused-exact"])
        }
        _ => Some(Vec::new()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ortelius::paper::texture_mapping::config::ReliefMethod;
    use ortelius::paper::virtual_texture::choices::{Listing, RequestDraw};

    #[test]
    fn shipped_scenes_have_the_variants_of_their_paper() {
        let names = |scene: &str| -> Vec<String> {
            let variants = own_variants(&Scene::embedded(scene).unwrap());
            variants.into_iter().map(|variant| variant.name).collect()
        };
        let globe = names("globe");
        // Besides the scene's own variant: five filters, four weight maps, and the other values of four settings.
        let stages = Dedup::ALL.len() + Compaction::ALL.len();
        let methods = stages + Listing::ALL.len() + RequestDraw::ALL.len() - 4;
        assert_eq!(globe.len(), 1 + 5 + 4 + methods, "{globe:?}");
        assert_eq!(globe[6], "weight_map: square", "maps come after the filters: {globe:?}");
        assert!(names("pole").iter().all(|name| !name.starts_with("weight_map")), "another filter");
        assert!(globe[1..3].iter().all(|name| name.contains("trilinear")), "filters come first: {globe:?}");
        assert_eq!(globe[5], "pbrt's EWA", "{globe:?}");
        assert!(
            ["bitset", "compact: ordered", "list: feedback"]
                .iter()
                .all(|name| globe.contains(&name.to_string()))
        );
        let herd = names("herd");
        assert!(herd.iter().any(|name| name.starts_with("order: ")) && herd.len() > 4, "{herd:?}");
        assert_eq!(names("relief-brick").len(), ReliefMethod::ALL.len());
    }

    #[test]
    fn a_variant_brings_the_changes_without_which_it_does_not_fit() {
        let globe = Scene::embedded("globe").unwrap();
        let changes = |scene: &Scene, name: &str| -> Option<String> {
            let variants = own_variants(scene);
            variants.into_iter().find(|variant| variant.name == name).map(|variant| variant.changes.join(" "))
        };
        let bitset = "variant.dedup=bitset variant.compact=append variant.address=own-level";
        assert_eq!(changes(&globe, "bitset").unwrap(), bitset);
        let fused = "variant.compact=fused-append variant.dedup=fused-exact";
        assert_eq!(changes(&globe, "compact: fused-append").unwrap(), fused);
        let texels = |dedup: &&Dedup| dedup.layout() == MaskLayout::Texels;
        let other =
            Dedup::ALL.iter().find(|dedup| !texels(dedup) && **dedup != Dedup::Bitset).unwrap().name();
        let other = [format!("variant.dedup={other}"), "variant.compact=append".to_owned()];
        let other = globe.with(&other).unwrap();
        assert_eq!(changes(&other, "compact: transform-feedback"), None, "{other:?} writes no texels");
        assert_eq!(changes(&other, "bitset").unwrap(), "variant.dedup=bitset variant.address=own-level");
    }
}
