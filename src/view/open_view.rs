//! What the window shows of a scene, and how it opens.

use super::path::Player;
use super::variants::{Variant, own_variants};
use ortelius::scene::Scene;
use ortelius::scene::camera::Camera;

/// A scene, seen from a camera or along a path.
#[derive(Clone, Debug)]
pub struct OpenView {
    pub name: String,
    /// The scene before a variant changes it.
    pub scene: Scene,
    pub camera: Camera,
    /// The path that is played. If `None`: the scene's first path.
    pub path: Option<String>,
    /// At least one variant.
    pub variants: Vec<Variant>,
}

impl OpenView {
    /// If `variants` is empty, the view gets the variants of the scene's paper.
    pub fn new(name: String, scene: Scene, camera: Camera, variants: Vec<Variant>) -> OpenView {
        let variants = if variants.is_empty() { own_variants(&scene) } else { variants };
        OpenView { name, scene, camera, path: None, variants }
    }

    /// The view with `path` as its path and the start of that path as its camera.
    pub fn along(self, path: String) -> OpenView {
        let mut player = Player::default();
        player.choose(&self.scene, &path);
        OpenView { camera: player.camera().unwrap_or(self.camera), path: Some(path), ..self }
    }

    /// The index of a variant.
    pub fn variant(&self, name: &str) -> Option<usize> {
        self.variants.iter().position(|variant| variant.name == name)
    }

    /// The path to play.
    pub fn player(&self) -> Player {
        let mut player = Player::new(&self.scene);
        self.path.iter().for_each(|path| player.choose(&self.scene, path));
        player
    }
}
