//! The variants that Space reaches: those of `--variant`, or the scene's own and the others of its paper.

use super::filters::other_filters;
use ortelius::paper::virtual_texture::MaskLayout;
use ortelius::paper::virtual_texture::choices::{Compaction, Dedup};
use ortelius::renderer::sections::LANGUAGES;
use ortelius::scene::{self, Scene, ValueKind};

/// A named set of overrides.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    pub name: String,
    /// In the syntax of `-D`, as KEY=VALUE.
    pub changes: Vec<String>,
}

/// The scene's own variant, then other filters of a virtual texture, which change the picture. Then one variant for
/// each other value of the setting that the scene's paper compares. This is the method that lists visible tiles, the
/// processor that applies changes of the level of detail, the filter of a relief, or the filter of a plain texture.
pub fn own_variants(scene: &Scene) -> Vec<Variant> {
    let own = Variant { name: "the scene's own".to_owned(), changes: Vec::new() };
    let keys = scene::keys(LANGUAGES);
    let is_virtual = |surface: &scene::Surface| scene.texture_kind(surface) == Some("virtual");
    let is_mesh =
        |name: &&String| scene.word(&["surface", name, "geometry", "kind"]) == Some("progressive-mesh");
    let has_relief = |name: &&String| scene.word(&["surface", name, "relief", "map"]).is_some();
    let names = || scene.surfaces.keys();
    let of_surface = [
        (names().find(is_mesh), "geometry.apply"),
        (names().find(has_relief), "relief.method"),
        (names().next(), "filter.kind"),
    ];
    let (declared, key) = if scene.surfaces.values().any(is_virtual) {
        ("variant.dedup".to_owned(), "variant.dedup".to_owned())
    } else {
        let found = of_surface.into_iter().find_map(|(name, key)| Some((name?, key)));
        let Some((name, key)) = found else { return vec![own] };
        (format!("surface.NAME.{key}"), format!("surface.{name}.{key}"))
    };
    let declared = keys.iter().find(|at| at.dotted == declared).expect("the setting is declared");
    let ValueKind::Choice(values) = &declared.key.kind else { return vec![own] };
    let path: Vec<&str> = key.split('.').collect();
    let default = declared.key.default.as_ref().and_then(|default| default.as_str());
    let now = scene.word(&path).or(default);
    let variant = |value: &str| {
        let mut changes = vec![format!("{key}={value}")];
        changes.extend(companions(scene, value).map(str::to_owned));
        Variant { name: value.to_owned(), changes }
    };
    let others = values.iter().filter(|(value, _)| Some(*value) != now).map(|(value, _)| variant(value));
    let filters =
        other_filters(scene).map(|(name, change)| Variant { name: name.to_owned(), changes: vec![change] });
    std::iter::once(own).chain(filters).chain(others).collect()
}

/// The changes without which a value of `variant.dedup` does not fit the scene's other settings.
fn companions(scene: &Scene, dedup: &str) -> impl Iterator<Item = &'static str> {
    let dedup = Dedup::ALL.iter().find(|value| value.name() == dedup);
    let compact = scene.word(&["variant", "compact"]).unwrap_or(Compaction::TransformFeedback.name());
    // The geometry shader of stage 3 reads texels alone.
    let computes = dedup.is_some_and(|dedup| dedup.layout() != MaskLayout::Texels)
        && compact == Compaction::TransformFeedback.name();
    let own_level = dedup == Some(&Dedup::Bitset);
    let changes = [(computes, "variant.compact=append"), (own_level, "variant.address=own-level")];
    changes.into_iter().filter_map(|(needed, change)| needed.then_some(change))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_scenes_have_the_variants_of_their_paper() {
        let names = |scene: &str| -> Vec<String> {
            let variants = own_variants(&Scene::embedded(scene).unwrap());
            variants.into_iter().map(|variant| variant.name).collect()
        };
        let globe = names("globe");
        assert_eq!(globe.len(), Dedup::ALL.len() + 2, "{globe:?}");
        assert!(globe[1..3].iter().all(|name| name.contains("trilinear")), "filters come first: {globe:?}");
        let herd = names("herd");
        assert!(herd.len() >= 2, "{herd:?}");
    }
}
