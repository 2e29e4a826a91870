//! What is to be seen: scene files, the surfaces in them, cameras and paths. Knows no paper.
//!
//! A scene is a TOML file with any number of `[surface.NAME]` (geometry x texture x filter), `[view]`,
//! `[cameras.NAME]`, `[paths.NAME]`, `[sun]`, and sections of techniques. Each setting has one owner, which declares it
//! with [`settings!`](settings): type, default, range, unit, documentation and check. This module declares what no
//! paper owns; a paper reads its part of a scene with [`Scene::read`]. [`Scene::check`] holds a whole scene against
//! all declarations, and the renderer, which knows them all, calls it wherever a user opens a scene.

pub mod camera;
mod declare;
mod document;
mod edit;
mod error;
mod eyes;
mod language;
pub mod markdown;
mod moved;
mod overrides;
mod part;
pub mod path;
pub mod schema;
mod sun;
mod surface;
mod value;

pub use declare::{Key, Language, Settings, Table, choices, names, one_line, settings};
pub use document::Fault;
pub use edit::write_changes;
pub use error::SceneError;
pub use eyes::View;
pub use language::{KeyAt, keys};
pub use part::Part;
pub use sun::Sun;
pub use surface::{Ellipsoid, Geometry, Plain, PlainSource, Plane, Surface};
pub use value::{Choice, Kind, Setting};

use crate::math::camera::Pose;
use camera::{Camera, Ground};
use document::Document;
use eyes::{CameraKeys, PathKeys};
use std::collections::BTreeMap;
use surface::SurfaceKeys;

/// The shipped scenes: name and text.
pub const SHIPPED: [(&str, &str); 9] = [
    ("antimeridian", include_str!("../../scenes/antimeridian.toml")),
    ("bunny", include_str!("../../scenes/bunny.toml")),
    ("earth", include_str!("../../scenes/earth.toml")),
    ("globe", include_str!("../../scenes/globe.toml")),
    ("herd", include_str!("../../scenes/herd.toml")),
    ("plane", include_str!("../../scenes/plane.toml")),
    ("pole", include_str!("../../scenes/pole.toml")),
    ("ruler", include_str!("../../scenes/ruler.toml")),
    ("valley", include_str!("../../scenes/valley.toml")),
];

/// What every scene can state, whatever techniques there are.
pub const LANGUAGE: Language = Language {
    tables: &[
        Table::of::<SurfaceKeys>(&["surface", "*"]),
        Table::of::<Ellipsoid>(&["surface", "*", "geometry"]),
        Table::of::<Plane>(&["surface", "*", "geometry"]),
        Table::of::<Plain>(&["surface", "*", "texture"]),
        Table::of::<View>(&["view"]),
        Table::of::<CameraKeys>(&["cameras", "*"]),
        Table::of::<PathKeys>(&["paths", "*"]),
        Table::of::<Sun>(&["sun"]),
    ],
    // Its own tables are read, and held against each other, when a scene is loaded.
    check: |_| Ok(()),
};

/// A scene whose own sections have been checked. Those of techniques are checked where they are read.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The file's stem, or the shipped scene's name.
    pub name: String,
    pub ground: Ground,
    pub surfaces: BTreeMap<String, Surface>,
    pub view: View,
    pub cameras: BTreeMap<String, Camera>,
    pub paths: BTreeMap<String, path::Path>,
    pub sun: Option<Sun>,
    document: Document,
}

/// Equal names, and the same values for the same keys.
impl PartialEq for Scene {
    fn eq(&self, other: &Scene) -> bool {
        (&self.name, &self.document.table) == (&other.name, &other.document.table)
    }
}

/// As the file has it, changes included.
impl serde::Serialize for Scene {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.document.table.serialize(serializer)
    }
}

impl Scene {
    /// Reads a scene file. Paths inside it are relative to its folder.
    ///
    /// # Errors
    /// [`SceneError`], with line, column and the line itself where something inside the file is wrong.
    pub fn load(path: &std::path::Path) -> Result<Scene, SceneError> {
        Scene::of(Document::read(path)?)
    }

    /// One of the [`SHIPPED`] scenes.
    ///
    /// # Errors
    /// [`SceneError::Unknown`] lists them.
    pub fn embedded(name: &str) -> Result<Scene, SceneError> {
        Scene::of(Document::shipped(name)?)
    }

    /// The scene that a file at `path` with this text would be.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn of_text(path: &std::path::Path, text: String) -> Result<Scene, SceneError> {
        Scene::of(Document::of_text(path, text)?)
    }

    /// The scene that [`Scene::to_parts`] took apart; `shown` stands for its file in messages.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn of_parts(
        shown: &str,
        name: &str,
        folder: &std::path::Path,
        text: String,
    ) -> Result<Scene, SceneError> {
        Scene::of(Document::of_parts(shown, name, folder, text)?)
    }

    /// A shipped scene by its name (`earth`), else a scene file by its path (`./earth` for a file of that
    /// name), with changes `KEY=VALUE`: dotted keys, any TOML value, bare words taken as strings. A
    /// path given so is relative to the working directory.
    ///
    /// # Errors
    /// [`SceneError`]; for a change it repeats the change.
    pub fn load_with(path_or_name: &str, overrides: &[String]) -> Result<Scene, SceneError> {
        let mut document = match Document::shipped(path_or_name) {
            Ok(document) => document,
            Err(unknown) => {
                let path = std::path::Path::new(path_or_name);
                // A bare word that is no file was meant as a name.
                if !path.exists() && path.components().count() == 1 && path.extension().is_none() {
                    return Err(unknown);
                }
                Document::read(path)?
            }
        };
        document.change(overrides)?;
        Scene::of(document)
    }

    /// This scene with more changes.
    ///
    /// # Errors
    /// [`SceneError::Override`].
    pub fn with(&self, changes: &[String]) -> Result<Scene, SceneError> {
        let mut document = self.document.clone();
        document.change(changes)?;
        Scene::of(document)
    }

    fn of(document: Document) -> Result<Scene, SceneError> {
        // Read bottom up: cameras need the ground, paths the cameras. Until then a placeholder stands in.
        let mut scene = Scene {
            name: document.name.clone(),
            ground: Ground::Plane,
            surfaces: BTreeMap::new(),
            view: View { width: 1, height: 1, camera: String::new(), path: None, background: [0.0; 3] },
            cameras: BTreeMap::new(),
            paths: BTreeMap::new(),
            sun: None,
            document,
        };
        match scene.read_own() {
            Ok(()) => Ok(scene),
            Err(fault) => Err(scene.error(fault)),
        }
    }

    fn read_own(&mut self) -> Result<(), Fault> {
        if let Some((key, now)) = moved::first_in(&self.document.table) {
            let what = moved::told(&key, &now, &self.document.table);
            return Err(Fault { of_key: true, ..Fault::new(&key, what) });
        }
        self.ground = surface::ground(self)?;
        let read = |section, name| (name, [section, name]);
        let mut cameras = BTreeMap::new();
        for (name, path) in eyes::names(self, "cameras")?.into_iter().map(|name| read("cameras", name)) {
            cameras.insert(name.to_owned(), eyes::camera(&Part::of(self, &path)?, self.ground)?);
        }
        let mut paths = BTreeMap::new();
        for (name, path) in eyes::names(self, "paths")?.into_iter().map(|name| read("paths", name)) {
            paths.insert(name.to_owned(), eyes::path(&Part::of(self, &path)?, &cameras)?);
        }
        let view = View::read(&Part::of(self, &["view"])?)?;
        eyes::check_view(&view, &cameras, &paths)?;
        let sun = Part::of(self, &["sun"])?;
        let sun = self.has(&["sun"]).then(|| Sun::read(&sun)).transpose()?;
        let surfaces = surface::surfaces(self)?;
        (self.surfaces, self.view, self.cameras, self.paths, self.sun) =
            (surfaces, view, cameras, paths, sun);
        Ok(())
    }

    /// Reads a technique's table; its defaults where the scene has none.
    ///
    /// # Errors
    /// [`SceneError`] at the key, also for keys that the table does not have.
    pub fn read<T: Settings>(&self, path: &[&str]) -> Result<T, SceneError> {
        Part::of(self, path).and_then(|part| T::read(&part)).map_err(|fault| self.error(fault))
    }

    /// Whether the scene states a key or a table.
    pub fn has(&self, key: &[&str]) -> bool {
        self.document.value(key).is_some()
    }

    /// Whether a change, not the file, decided the value of a key.
    pub fn changed(&self, key: &[&str]) -> bool {
        self.document.changed(key)
    }

    /// What the scene states for a key.
    pub fn value(&self, key: &[&str]) -> Option<&toml::Value> {
        self.document.value(key)
    }

    /// A key's text, where it has one: for the `kind` of a table.
    pub fn word(&self, key: &[&str]) -> Option<&str> {
        self.document.value(key)?.as_str()
    }

    /// The `kind` of a surface's texture, its own or the one that it shares.
    pub fn texture_kind(&self, surface: &Surface) -> Option<&str> {
        self.word(&["surface", surface.texture.as_ref()?, "texture", "kind"])
    }

    /// An error at a key, for faults that are found after the scene was read.
    pub fn fault(&self, key: &[&str], what: impl Into<String>) -> SceneError {
        self.error(Fault::new(key, what))
    }

    /// [`Scene::fault`], for a [`Fault`].
    pub fn error(&self, fault: Fault) -> SceneError {
        self.document.error(fault)
    }

    /// Where a key was set, for messages of one line: `s.toml:4:8: surface.land.texture.path`, or `-D CHANGE`.
    pub fn place(&self, key: &[&str]) -> String {
        self.document.place(key)
    }

    /// The scene as TOML, changes included.
    pub fn to_toml(&self) -> String {
        self.document.table.to_string()
    }

    /// A camera by name.
    ///
    /// # Errors
    /// [`SceneError::Camera`] lists those that exist.
    pub fn camera(&self, name: &str) -> Result<&Camera, SceneError> {
        self.cameras.get(name).ok_or_else(|| SceneError::Camera {
            scene: self.name.clone(),
            name: name.to_owned(),
            existing: error::list(self.cameras.keys()),
        })
    }

    /// A path by name.
    ///
    /// # Errors
    /// [`SceneError::Path`] lists those that exist.
    pub fn path(&self, name: &str) -> Result<&path::Path, SceneError> {
        self.paths.get(name).ok_or_else(|| SceneError::Path {
            scene: self.name.clone(),
            name: name.to_owned(),
            existing: error::list(self.paths.keys()),
        })
    }

    /// The eye at a frame: on the view's path if it names one, else at its camera.
    ///
    /// # Errors
    /// [`SceneError::Camera`] or [`SceneError::Path`], possible only after `view` was changed by hand.
    pub fn pose(&self, frame: u32) -> Result<Pose, SceneError> {
        match &self.view.path {
            Some(name) => Ok(self.path(name)?.pose(frame)),
            None => Ok(self.camera(&self.view.camera)?.pose()),
        }
    }
}
