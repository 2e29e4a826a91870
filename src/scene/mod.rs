//! Scene files: surfaces, cameras and paths. Independent of the papers.
//!
//! A scene is a TOML file with any number of `[surface.NAME]` (geometry x texture x filter), `[view]`,
//! `[cameras.NAME]`, `[paths.NAME]`, `[sun]`, and sections of techniques. Each setting is declared once, by its
//! owner, with [`settings!`](settings): type, default, range, unit, documentation and check. This module declares the
//! settings that belong to no paper; a paper reads its part of a scene with [`Scene::read`]. [`Scene::check`] checks
//! a whole scene against all declarations. The renderer, which knows all of them, calls it for every scene that a
//! user opens.

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

pub use declare::{KeyDeclaration, Language, Settings, TableDeclaration, choices, names, one_line, settings};
pub use document::SceneFault;
pub use edit::write_changes;
pub use error::SceneError;
pub use eyes::PictureSettings;
pub use language::{KeyAt, keys};
pub use overrides::unread_filter_keys;
pub use part::SceneTable;
pub use sun::Sun;
pub use surface::{Cylinder, Ellipsoid, FilterBound, Geometry, Plain, PlainSource, Plane, Surface};
pub use value::{Choice, SettingValue, ValueKind};

use crate::math::camera::Pose;
use camera::{Camera, Ground};
use document::Document;
use eyes::{CameraKeys, PathKeys};
use std::collections::BTreeMap;
use surface::SurfaceKeys;

/// The shipped scenes: name and text.
pub const SHIPPED: [(&str, &str); 15] = [
    ("antimeridian", include_str!("../../scenes/antimeridian.toml")),
    ("bunny", include_str!("../../scenes/bunny.toml")),
    ("earth", include_str!("../../scenes/earth.toml")),
    ("globe", include_str!("../../scenes/globe.toml")),
    ("herd", include_str!("../../scenes/herd.toml")),
    ("plane", include_str!("../../scenes/plane.toml")),
    ("plane-tilt", include_str!("../../scenes/plane-tilt.toml")),
    ("pole", include_str!("../../scenes/pole.toml")),
    ("relief-brick", include_str!("../../scenes/relief-brick.toml")),
    ("relief-rock", include_str!("../../scenes/relief-rock.toml")),
    ("ruler", include_str!("../../scenes/ruler.toml")),
    ("sphere", include_str!("../../scenes/sphere.toml")),
    ("tunnel", include_str!("../../scenes/tunnel.toml")),
    ("valley", include_str!("../../scenes/valley.toml")),
    ("zone-plate", include_str!("../../scenes/zone-plate.toml")),
];

/// Settings that every scene can have, independent of techniques.
pub const LANGUAGE: Language = Language {
    tables: &[
        TableDeclaration::of::<SurfaceKeys>(&["surface", "*"]),
        TableDeclaration::of::<Ellipsoid>(&["surface", "*", "geometry"]),
        TableDeclaration::of::<Plane>(&["surface", "*", "geometry"]),
        TableDeclaration::of::<Cylinder>(&["surface", "*", "geometry"]),
        TableDeclaration::of::<Plain>(&["surface", "*", "texture"]),
        TableDeclaration::of::<PictureSettings>(&["view"]),
        TableDeclaration::of::<CameraKeys>(&["cameras", "*"]),
        TableDeclaration::of::<PathKeys>(&["paths", "*"]),
        TableDeclaration::of::<Sun>(&["sun"]),
    ],
    // The tables above are read, and checked against each other, when a scene is loaded.
    check: |_| Ok(()),
};

/// A scene whose own sections are checked. Sections of techniques are checked when they are read.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The file's stem, or the shipped scene's name.
    pub name: String,
    pub ground: Ground,
    pub surfaces: BTreeMap<String, Surface>,
    pub view: PictureSettings,
    pub cameras: BTreeMap<String, Camera>,
    pub paths: BTreeMap<String, path::CameraPath>,
    pub sun: Option<Sun>,
    document: Document,
}

/// Equal if the names are equal and the same keys have the same values.
impl PartialEq for Scene {
    fn eq(&self, other: &Scene) -> bool {
        (&self.name, &self.document.table) == (&other.name, &other.document.table)
    }
}

/// The file's content with overrides applied.
impl serde::Serialize for Scene {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.document.table.serialize(serializer)
    }
}

impl Scene {
    /// Reads a scene file. Paths inside it are relative to its folder.
    ///
    /// # Errors
    /// [`SceneError`], with line, column and the line itself for an error inside the file.
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

    /// Parses `text` as the scene file `path`.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn from_text(path: &std::path::Path, text: String) -> Result<Scene, SceneError> {
        Scene::of(Document::from_text(path, text)?)
    }

    /// Rebuilds the scene from [`Scene::to_parts`]; messages show `shown` as its file.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn from_parts(
        shown: &str,
        name: &str,
        folder: &std::path::Path,
        text: String,
    ) -> Result<Scene, SceneError> {
        Scene::of(Document::from_parts(shown, name, folder, text)?)
    }

    /// Loads a shipped scene by name (`earth`), otherwise a scene file by path (`./earth` for a file of that name).
    /// Overrides are `KEY=VALUE` with dotted keys and any TOML value; single words are taken as strings. A path in an
    /// override is relative to the working directory.
    ///
    /// # Errors
    /// [`SceneError`]; for an invalid override it shows the override.
    pub fn load_with(path_or_name: &str, overrides: &[String]) -> Result<Scene, SceneError> {
        let mut document = match Document::shipped(path_or_name) {
            Ok(document) => document,
            Err(unknown) => {
                let path = std::path::Path::new(path_or_name);
                // A single word that is not a file was meant as a name.
                if !path.exists() && path.components().count() == 1 && path.extension().is_none() {
                    return Err(unknown);
                }
                Document::read(path)?
            }
        };
        document.change(overrides)?;
        Scene::of(document)
    }

    /// This scene with more overrides.
    ///
    /// # Errors
    /// [`SceneError::Override`].
    pub fn with(&self, changes: &[String]) -> Result<Scene, SceneError> {
        let mut document = self.document.clone();
        document.change(changes)?;
        Scene::of(document)
    }

    fn of(document: Document) -> Result<Scene, SceneError> {
        // Parts are read in the order in which they depend on each other: cameras need the ground, paths need
        // the cameras. Parts not yet read have placeholders.
        let mut scene = Scene {
            name: document.name.clone(),
            ground: Ground::Plane,
            surfaces: BTreeMap::new(),
            view: PictureSettings {
                width: 1,
                height: 1,
                camera: String::new(),
                path: None,
                background: [0.0; 3],
            },
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

    fn read_own(&mut self) -> Result<(), SceneFault> {
        if let Some((key, now)) = moved::first_in(&self.document.table) {
            let what = moved::message(&key, &now, &self.document.table);
            return Err(SceneFault { of_key: true, ..SceneFault::new(&key, what) });
        }
        self.ground = surface::ground(self)?;
        let read = |section, name| (name, [section, name]);
        let mut cameras = BTreeMap::new();
        for (name, path) in eyes::names(self, "cameras")?.into_iter().map(|name| read("cameras", name)) {
            cameras.insert(name.to_owned(), eyes::camera(&SceneTable::of(self, &path)?, self.ground)?);
        }
        let mut paths = BTreeMap::new();
        for (name, path) in eyes::names(self, "paths")?.into_iter().map(|name| read("paths", name)) {
            paths.insert(name.to_owned(), eyes::path(&SceneTable::of(self, &path)?, &cameras)?);
        }
        let view = PictureSettings::read(&SceneTable::of(self, &["view"])?)?;
        eyes::check_view(&view, &cameras, &paths)?;
        let sun = SceneTable::of(self, &["sun"])?;
        let sun = self.has(&["sun"]).then(|| Sun::read(&sun)).transpose()?;
        let surfaces = surface::surfaces(self)?;
        (self.surfaces, self.view, self.cameras, self.paths, self.sun) =
            (surfaces, view, cameras, paths, sun);
        Ok(())
    }

    /// Reads a technique's table; returns its defaults if the scene does not have it.
    ///
    /// # Errors
    /// [`SceneError`] with the key; also for unknown keys of the table.
    pub fn read<T: Settings>(&self, path: &[&str]) -> Result<T, SceneError> {
        SceneTable::of(self, path).and_then(|part| T::read(&part)).map_err(|fault| self.error(fault))
    }

    /// True if the scene states a key or a table.
    pub fn has(&self, key: &[&str]) -> bool {
        self.document.value(key).is_some()
    }

    /// True if an override, not the file, set the value of a key.
    pub fn changed(&self, key: &[&str]) -> bool {
        self.document.changed(key)
    }

    /// The value that the scene states for a key.
    pub fn value(&self, key: &[&str]) -> Option<&toml::Value> {
        self.document.value(key)
    }

    /// A key's string value, if it has one; used for the `kind` of a table.
    pub fn word(&self, key: &[&str]) -> Option<&str> {
        self.document.value(key)?.as_str()
    }

    /// The `kind` of a surface's texture, whether its own or shared.
    pub fn texture_kind(&self, surface: &Surface) -> Option<&str> {
        self.word(&["surface", surface.texture.as_ref()?, "texture", "kind"])
    }

    /// An error at a key, for faults found after the scene was read.
    pub fn fault(&self, key: &[&str], what: impl Into<String>) -> SceneError {
        self.error(SceneFault::new(key, what))
    }

    /// [`Scene::fault`], for a [`SceneFault`].
    pub fn error(&self, fault: SceneFault) -> SceneError {
        self.document.error(fault)
    }

    /// Origin of a key for one-line messages: `s.toml:4:8: surface.land.texture.path`, or `-D CHANGE`.
    pub fn place(&self, key: &[&str]) -> String {
        self.document.place(key)
    }

    /// The scene as TOML, with its overrides.
    pub fn to_toml(&self) -> String {
        self.document.table.to_string()
    }

    /// Finds a camera by name.
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

    /// Finds a path by name.
    ///
    /// # Errors
    /// [`SceneError::Path`] lists those that exist.
    pub fn path(&self, name: &str) -> Result<&path::CameraPath, SceneError> {
        self.paths.get(name).ok_or_else(|| SceneError::Path {
            scene: self.name.clone(),
            name: name.to_owned(),
            existing: error::list(self.paths.keys()),
        })
    }

    /// The camera pose of a frame: on the view's path if there is one, otherwise at its camera.
    ///
    /// # Errors
    /// [`SceneError::Camera`] or [`SceneError::Path`], possible only if `view` was modified afterwards.
    pub fn pose(&self, frame: u32) -> Result<Pose, SceneError> {
        match &self.view.path {
            Some(name) => Ok(self.path(name)?.pose(frame)),
            None => Ok(self.camera(&self.view.camera)?.pose()),
        }
    }
}
