//! From a scene's names to progressive meshes.

use super::surface::Model;
use crate::model::{self, ModelError};
use crate::paper::progressive_mesh::file::{Extent, PmeshError};
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::order::{OrderOptions, classical, order};
use crate::paper::progressive_mesh::simplify::{Collapses, SimplifyOptions, simplify};
use crate::scene::{FaceOrder, ModelSource, ProgressiveSurface, Scene};
use thiserror::Error;

/// A surface that is not to be had.
#[derive(Debug, Error)]
pub enum LoadError {
    #[error("progressive_mesh.{surface}.source: {error}")]
    Pmesh { surface: String, error: PmeshError },
    #[error("progressive_mesh.{surface}.source: {error}")]
    Model { surface: String, error: ModelError },
    #[error(
        "progressive_mesh.{surface}.order: {order} goes through the faces of a .pmesh in classical order, and {file} has \
         another; build it with --order classical"
    )]
    Order { surface: String, order: &'static str, file: String },
}

/// All surfaces of a scene, simplified and ordered as it says.
///
/// # Errors
/// [`LoadError`] names the surface's key, and the file or the model.
pub fn load(scene: &Scene) -> Result<Vec<Model>, LoadError> {
    let load = |(name, surface): (&String, &ProgressiveSurface)| {
        let (mesh, cut_from) = mesh(name, surface)?;
        Ok(Model {
            name: name.clone(),
            mesh,
            cut_from,
            stands: surface.stands(&scene.paths),
            textured: None,
            surface: surface.clone(),
        })
    };
    scene.progressive_meshes.iter().map(load).collect()
}

/// The mesh, and what its file holds when whole where its end is missing.
fn mesh(name: &str, surface: &ProgressiveSurface) -> Result<(ProgressiveMesh, Option<Extent>), LoadError> {
    if let ModelSource::File(path) = &surface.source
        && path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("pmesh"))
    {
        // Its order was chosen when it was built.
        let read = ProgressiveMesh::read(path);
        let read = read.map_err(|error| LoadError::Pmesh { surface: name.to_owned(), error })?;
        if surface.order.is_rival() && !read.mesh.swaps.levels.is_empty() {
            let (order, file) = (surface.order.name(), path.display().to_string());
            return Err(LoadError::Order { surface: name.to_owned(), order, file });
        }
        let Some(missing) = read.contents.missing() else { return Ok((read.mesh, None)) };
        tracing::warn!("progressive_mesh.{name}.source: {}: {missing}", path.display());
        return Ok((read.mesh, Some(read.contents.whole)));
    }
    let (read, source) = match &surface.source {
        ModelSource::Named(named) => (model::Model::open(named), named.clone()),
        ModelSource::File(path) => (model::Model::load(path), path.display().to_string()),
    };
    let (model, report) = read.map_err(|error| LoadError::Model { surface: name.to_owned(), error })?;
    report.changes().iter().for_each(|change| tracing::warn!("{source}: {change}"));
    let simplified = simplify(&model, &SimplifyOptions::default(), &mut |_, _| ());
    Ok((ordered(&model, &simplified.collapses, surface.order), None))
}

/// A model's progressive mesh with its faces in one of the orders; for a rival in the classical one, which it goes
/// through.
pub fn ordered(model: &model::Model, collapses: &Collapses, face_order: FaceOrder) -> ProgressiveMesh {
    match OrderOptions::of(face_order) {
        Some(options) => order(model, collapses, &options, &mut |_, _| ()),
        None => classical(model, collapses),
    }
}
