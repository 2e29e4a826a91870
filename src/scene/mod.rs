//! What is to be seen: scene files, cameras and paths, meshes, and where a texture's tiles come from.
//!
//! A scene is a TOML file with the sections `[view]`, `[cameras.NAME]` and `[paths.NAME]`, and what is seen: paper 1's
//! landscape (`[texture]`, `[cache]`, `[disk]`, `[mesh]` and `[variant]`), or paper 2's surfaces
//! (`[progressive_mesh.NAME]` and `[governor]`). Everything in a [`Scene`] has been checked: a value of this type can be
//! drawn, as far as that can be known without its texture file and without a device.

pub mod camera;
mod check;
mod choice;
mod edit;
mod error;
mod face_order;
mod file;
mod open;
mod overrides;
pub mod path;
mod progressive_mesh;
mod settings;

pub use choice::{Compaction, Dedup, Listing};
pub use edit::write_changes;
pub use error::SceneError;
pub use face_order::FaceOrder;
pub use open::TextureError;
pub use progressive_mesh::{Apply, GovernorSettings, Layout, ModelSource, ProgressiveSurface, Stand, UpAxis};
pub use settings::{
    Cache, Filtering, Interpolation, Keying, MeshSpec, Order, Texture, TextureSource, TriplesFormat, Variant,
    View,
};

use crate::math::camera::Pose;
use crate::model::mesh::{self, MeshError, SourceMesh};
use crate::texture::source::disk::Disk;
use camera::Camera;
use serde::Serialize;
use std::collections::BTreeMap;

/// The shipped scenes: name and text.
pub const SHIPPED: [(&str, &str); 8] = [
    ("antimeridian", include_str!("../../scenes/antimeridian.toml")),
    ("bunny", include_str!("../../scenes/bunny.toml")),
    ("earth", include_str!("../../scenes/earth.toml")),
    ("globe", include_str!("../../scenes/globe.toml")),
    ("herd", include_str!("../../scenes/herd.toml")),
    ("plane", include_str!("../../scenes/plane.toml")),
    ("pole", include_str!("../../scenes/pole.toml")),
    ("ruler", include_str!("../../scenes/ruler.toml")),
];

/// A checked scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scene {
    /// The file's stem, or the shipped scene's name.
    pub name: String,
    /// The landscape's, with `mesh`; both or none.
    pub texture: Option<Texture>,
    pub cache: Cache,
    pub disk: Disk,
    pub mesh: Option<MeshSpec>,
    /// By name; empty where there is a landscape.
    pub progressive_meshes: BTreeMap<String, ProgressiveSurface>,
    pub governor: Option<GovernorSettings>,
    pub view: View,
    pub cameras: BTreeMap<String, Camera>,
    pub paths: BTreeMap<String, path::Path>,
    pub variant: Variant,
}

impl Scene {
    /// Reads a scene file. Paths inside it are relative to its folder.
    ///
    /// # Errors
    /// [`SceneError`], with line, column and the line itself where something inside the file is wrong.
    pub fn load(path: &std::path::Path) -> Result<Scene, SceneError> {
        file::Document::read(path)?.scene(&[])
    }

    /// One of the [`SHIPPED`] scenes.
    ///
    /// # Errors
    /// [`SceneError::Unknown`] lists them.
    pub fn embedded(name: &str) -> Result<Scene, SceneError> {
        file::Document::shipped(name)?.scene(&[])
    }

    /// A shipped scene by its name (`earth`), else a scene file by its path (`./earth` for a file of that
    /// name), with changes `KEY=VALUE`: dotted keys, any TOML value, bare words taken as strings. A
    /// `texture.path` given so is relative to the working directory.
    ///
    /// # Errors
    /// [`SceneError`]; for a change it repeats the change, and suggests the nearest key for an unknown one.
    pub fn load_with(path_or_name: &str, overrides: &[String]) -> Result<Scene, SceneError> {
        let document = match file::Document::shipped(path_or_name) {
            Ok(document) => document,
            Err(unknown) => {
                let path = std::path::Path::new(path_or_name);
                // A bare word that is no file was meant as a name.
                if !path.exists() && path.components().count() == 1 && path.extension().is_none() {
                    return Err(unknown);
                }
                file::Document::read(path)?
            }
        };
        document.scene(overrides)
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

    /// The landscape's triangles.
    ///
    /// # Errors
    /// [`MeshError::Absent`]; any other only after `mesh` was changed by hand.
    pub fn source_mesh(&self) -> Result<SourceMesh, MeshError> {
        match self.mesh.ok_or_else(|| MeshError::Absent(self.name.clone()))? {
            MeshSpec::Earth { columns, rows } => mesh::earth(columns, rows),
            MeshSpec::Plane { width_m, height_m, columns, rows } => {
                mesh::plane(width_m, height_m, columns, rows)
            }
        }
    }
}
