//! Looks up figures by id, and loads the scenes of their views.

use super::FAMILIES;
use crate::figure::{Figure, FigureView};
use crate::renderer::sections;
use crate::scene::{Scene, SceneError};

/// The figure with this id.
pub fn find(id: &str) -> Option<&'static Figure> {
    FAMILIES.iter().flat_map(|(_, figures)| figures.iter()).find(|figure| figure.id == id).copied()
}

/// Changes of a view or of a variant for one scene: `surface.NAME` becomes the scene's first surface.
pub fn for_scene(changes: &[String], scene: &Scene) -> Vec<String> {
    let first = scene.surfaces.keys().next().map_or("NAME", String::as_str);
    changes.iter().map(|change| change.replacen("surface.NAME.", &format!("surface.{first}."), 1)).collect()
}

/// The scene of a view with its changes.
///
/// # Errors
/// [`SceneError`].
pub fn scene_of(view: &FigureView) -> Result<Scene, SceneError> {
    sections::load(&view.scene, &for_scene(&view.changes, &Scene::embedded(&view.scene)?))
}
