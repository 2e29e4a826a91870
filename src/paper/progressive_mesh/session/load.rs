//! From a scene's names to progressive meshes.

use super::surface::Model;
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::order::classical;
use crate::paper::progressive_mesh::simplify::{SimplifyOptions, simplify};
use crate::scene::model;
use crate::scene::{FaceOrder, ModelSource, ProgressiveSurface, Scene};
use thiserror::Error;

/// A surface that is not to be had.
#[derive(Debug, Error)]
pub enum LoadError {
    #[error("progressive_mesh.{surface}.source: no shipped model is called {name:?}; there are {existing}")]
    Unknown { surface: String, name: String, existing: String },
    #[error("progressive_mesh.{surface}.source: {path}: files are not shown; name a shipped model")]
    File { surface: String, path: String },
}

/// All surfaces of a scene, simplified and ordered as it says.
///
/// # Errors
/// [`LoadError`] names the surface's key, and the file or the model.
pub fn load(scene: &Scene) -> Result<Vec<Model>, LoadError> {
    let load = |(name, surface): (&String, &ProgressiveSurface)| {
        Ok(Model {
            name: name.clone(),
            mesh: mesh(name, surface)?,
            stands: surface.stands(&scene.paths),
            surface: surface.clone(),
        })
    };
    scene.progressive_meshes.iter().map(load).collect()
}

fn mesh(name: &str, surface: &ProgressiveSurface) -> Result<ProgressiveMesh, LoadError> {
    let model = match &surface.source {
        ModelSource::Shipped(shipped) => model::named(shipped).ok_or_else(|| LoadError::Unknown {
            surface: name.to_owned(),
            name: shipped.clone(),
            existing: model::NAMES.join(", "),
        })?,
        ModelSource::File(path) => {
            return Err(LoadError::File { surface: name.to_owned(), path: path.display().to_string() });
        }
    };
    let simplified = simplify(&model, &SimplifyOptions::default(), &mut |_, _| ());
    Ok(match surface.order {
        FaceOrder::Classical | FaceOrder::Literal | FaceOrder::Ours => {
            classical(&model, &simplified.collapses)
        }
    })
}
