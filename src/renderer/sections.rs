//! The whole language of scenes: what every scene can state, and what each paper adds.

use crate::paper::{progressive_mesh, virtual_texture};
use crate::scene::{self, Language, Scene, SceneError};

/// All declarations of settings.
pub const LANGUAGES: &[&Language] =
    &[&scene::LANGUAGE, &virtual_texture::config::LANGUAGE, &progressive_mesh::config::LANGUAGE];

/// Holds a whole scene against all declarations.
///
/// # Errors
/// [`SceneError`] at the first fault.
pub fn check(scene: &Scene) -> Result<(), SceneError> {
    scene.check(LANGUAGES)
}

/// As [`Scene::load_with`], for a user: everything in the scene is checked, also what nothing would read.
///
/// # Errors
/// [`SceneError`].
pub fn load(path_or_name: &str, overrides: &[String]) -> Result<Scene, SceneError> {
    let scene = Scene::load_with(path_or_name, overrides)?;
    check(&scene)?;
    Ok(scene)
}
