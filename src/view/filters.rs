//! Filters to compare with a scene's own.

use ortelius::paper::virtual_texture::{Filtering, VirtualTextureSettings};
use ortelius::picture::PixelFormat;
use ortelius::renderer::sections;
use ortelius::scene::{Scene, Surface};

/// Names, and values of `surface.NAME.filter`.
const FILTERS: [(&str, &str); 6] = [
    ("paper 3: ellipse", "{ kind = 'ellipse', max_anisotropy = 16 }"),
    ("paper 1: up to 16 trilinear samples", "{}"),
    ("one trilinear sample", "{ max_anisotropy = 1 }"),
    ("Feline: up to 16 trilinear samples", "{ kind = 'feline', max_anisotropy = 16 }"),
    ("Mavridis and Papaioannou: 4 taps", "{ kind = 'mavridis', max_anisotropy = 4 }"),
    ("pbrt's EWA", "{ kind = 'pbrt' }"),
];

/// Filters of the scene's virtual texture that differ from its own, with the change that selects each. Unlike the
/// values of `variant.dedup`, they change the picture.
pub fn other_filters(scene: &Scene) -> impl Iterator<Item = (&'static str, String)> {
    let is_virtual = |surface: &&Surface| scene.texture_kind(surface) == Some("virtual");
    let surface = scene.surfaces.values().find(is_virtual);
    let changes = surface.into_iter().flat_map(|surface| FILTERS.map(|(name, value)| (name, surface, value)));
    let changes =
        changes.map(|(name, surface, value)| (name, format!("surface.{}.filter={value}", surface.name)));
    changes.filter(|(_, change)| {
        let other =
            scene.with(std::slice::from_ref(change)).ok().filter(|other| sections::check(other).is_ok());
        other.is_some_and(|other| filter(&other) != filter(scene))
    })
}

/// The two settings of the scene's filter that [`FILTERS`] vary: its kind and its largest anisotropy.
fn filter(scene: &Scene) -> Option<(Filtering, u32)> {
    let filter = VirtualTextureSettings::of_scene(scene, PixelFormat::Srgb8).ok()?.config.filter;
    Some((filter.kind, filter.max_anisotropy))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_filters_differ_from_the_scenes_own() {
        let names = |scene: &Scene| other_filters(scene).map(|(name, _)| name).collect::<Vec<_>>();
        let [ellipse, papers, one, feline, mavridis, pbrt] = FILTERS.map(|(name, _)| name);
        let globe = Scene::embedded("globe").unwrap();
        assert_eq!(names(&globe), [papers, one, feline, mavridis, pbrt]);
        assert_eq!(names(&Scene::embedded("pole").unwrap()), [ellipse, one, feline, mavridis, pbrt]);
        let changed = globe.with(&["surface.land.filter={max_anisotropy=1}".to_owned()]).unwrap();
        assert_eq!(names(&changed), [ellipse, papers, feline, mavridis, pbrt]);
        assert!(names(&Scene::embedded("herd").unwrap()).is_empty(), "no virtual texture");
    }
}
