//! All settings of scenes: the settings of every scene, and the settings that each paper adds.

use crate::paper::{progressive_mesh, texture_mapping, virtual_texture};
use crate::scene::{self, Language, Scene, SceneError};

/// All declarations of settings.
pub const LANGUAGES: &[&Language] = &[
    &scene::LANGUAGE,
    &virtual_texture::config::LANGUAGE,
    &progressive_mesh::config::LANGUAGE,
    &texture_mapping::config::LANGUAGE,
];

/// Checks a whole scene against all declarations.
///
/// # Errors
/// [`SceneError`] at the first fault.
pub fn check(scene: &Scene) -> Result<(), SceneError> {
    scene.check(LANGUAGES)
}

/// Like [`Scene::load_with`], for scenes of users: checks everything in the scene, including settings that are not
/// used.
///
/// # Errors
/// [`SceneError`].
pub fn load(path_or_name: &str, overrides: &[String]) -> Result<Scene, SceneError> {
    let scene = Scene::load_with(path_or_name, overrides)?;
    check(&scene)?;
    Ok(scene)
}
