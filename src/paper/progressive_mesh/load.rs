//! Loads a scene's progressive meshes.

use super::choices::ErrorMetric;
use super::config::{self, ModelSource, ProgressiveSurface};
use super::file::{Extent, PmeshError};
use super::ground::Heights;
use super::keep::kept_or_built;
use super::mesh::ProgressiveMesh;
use super::place::{Bounds, Placement};
use super::simplify::SimplifyOptions;
use super::stand::{Stand, stands};
use crate::model::{self, Attributes, ModelError};
use crate::scene::{Geometry, Plane, Scene, SceneError};
use std::collections::HashMap;
use thiserror::Error;

/// A surface that is ready to be drawn.
#[derive(Clone, Debug)]
pub struct LoadedMesh {
    /// Its name in the scene.
    pub name: String,
    pub surface: ProgressiveSurface,
    pub mesh: ProgressiveMesh,
    /// If the file is truncated, the extent of the complete file.
    pub cut_from: Option<Extent>,
    /// The place of each instance.
    pub stands: Vec<Stand>,
    /// Set if another technique textures the surface. The mesh then has texture coordinates in 0 ..= 1, and
    /// `surface.geomorph` is false.
    pub textured: Option<Textured>,
}

impl LoadedMesh {
    /// A mesh of a complete file, without texture, before it is moved onto its ground.
    pub fn new(scene: &Scene, name: &str, surface: ProgressiveSurface, mesh: ProgressiveMesh) -> LoadedMesh {
        let stands = stands(scene, &surface);
        LoadedMesh { name: name.to_owned(), surface, mesh, cut_from: None, stands, textured: None }
    }
}

/// How another technique textures a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Textured {
    /// True if the sun lights the surface.
    pub lit: bool,
}

/// A progressive mesh that cannot be loaded. `place` locates the source, order or metric in the scene file.
#[derive(Debug, Error)]
pub enum LoadError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("{place}: {error}")]
    Pmesh { place: String, error: PmeshError },
    #[error("{place}: {error}")]
    Model { place: String, error: ModelError },
    #[error(
        "{place}: {order} needs a .pmesh in classical order, but {file} has another order; build it with \
         --order classical"
    )]
    Order { place: String, order: &'static str, file: String },
    #[error(
        "{place}: {file} was built with {built}; leave the key out, or build the file with --metric {wanted}"
    )]
    Metric { place: String, wanted: &'static str, file: String, built: String },
}

/// All progressive meshes of a scene, simplified and ordered, with each instance on its ground.
///
/// # Errors
/// [`LoadError`] names the surface's key, and the file or the model.
pub fn load(scene: &Scene) -> Result<Vec<LoadedMesh>, LoadError> {
    let load = |name: &str| {
        let mut surface = config::surface(scene, name)?;
        let (mesh, cut_from) = mesh(scene, name, &surface)?;
        surface.metric = mesh.metric;
        Ok(LoadedMesh { cut_from, ..LoadedMesh::new(scene, name, surface, mesh) })
    };
    let mut models = config::names(scene).map(load).collect::<Result<Vec<_>, LoadError>>()?;
    let grounds: HashMap<String, Heights> = models
        .iter()
        .filter(|model| models.iter().any(|other| other.surface.ground.as_ref() == Some(&model.name)))
        .map(|model| (model.name.clone(), heights(model)))
        .collect();
    for model in &mut models {
        put_on_ground(scene, model, &grounds)?;
    }
    Ok(models)
}

fn heights(model: &LoadedMesh) -> Heights {
    let stand = model.stands[0];
    let place = Placement::new(&model.surface, &Bounds::of(&model.mesh.vertices.positions), &stand);
    Heights::new(&model.mesh, &place, &stand)
}

/// Moves each instance onto the surface's ground, if it has one.
fn put_on_ground(
    scene: &Scene,
    model: &mut LoadedMesh,
    grounds: &HashMap<String, Heights>,
) -> Result<(), SceneError> {
    let Some(ground) = &model.surface.ground else { return Ok(()) };
    let plane = |plane: &Plane, stand: &Stand| {
        let within = |at: f64, side_m: f64| 2.0 * at.abs() <= side_m;
        (within(stand.foot.x, plane.width_m) && within(stand.foot.y, plane.height_m)).then_some(stand.foot)
    };
    for (n, stand) in model.stands.iter_mut().enumerate() {
        let foot = match &scene.surfaces[ground].geometry {
            // `up_m` counts from height 0, which is the plane's height.
            Geometry::Plane(rectangle) => plane(rectangle, stand),
            _ => grounds[ground].foot(stand, model.surface.up_m),
        };
        stand.foot = foot.ok_or_else(|| {
            let what =
                format!("instance {n}, at {:.1}, is not above {ground}; choose a smaller area", stand.foot);
            scene.fault(&["surface", &model.name, "geometry", "ground"], what)
        })?;
    }
    Ok(())
}

/// Checks that a model has texture coordinates if its surface has a texture.
fn check_coordinates(scene: &Scene, name: &str, attributes: &Attributes) -> Result<(), SceneError> {
    let surface = &scene.surfaces[name];
    let within = |coordinate: &[f32; 2]| coordinate.iter().all(|x| (0.0..=1.0).contains(x));
    let what = match &attributes.coordinates[..] {
        _ if surface.texture.is_none() => return Ok(()),
        [] => "the model has no texture coordinates; leave out the texture, or name a model that has them",
        coordinates if coordinates.iter().all(within) => return Ok(()),
        _ => {
            "the model has texture coordinates outside 0 ..= 1, which no texture covers; leave out the texture, or \
             name another model"
        }
    };
    Err(scene.fault(&["surface", name, "texture"], what))
}

/// The mesh, and the extent of the complete file if its file is truncated.
fn mesh(
    scene: &Scene,
    name: &str,
    surface: &ProgressiveSurface,
) -> Result<(ProgressiveMesh, Option<Extent>), LoadError> {
    let place = |key| scene.place(&["surface", name, "geometry", key]);
    if let ModelSource::File(path) = &surface.source
        && path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("pmesh"))
    {
        // A .pmesh keeps the order with which it was built.
        let read = ProgressiveMesh::read(path);
        let read = read.map_err(|error| LoadError::Pmesh { place: place("source"), error })?;
        check_coordinates(scene, name, &read.mesh.vertices.attributes)?;
        if surface.order.is_baseline() && !read.mesh.swaps.levels.is_empty() {
            let (order, file) = (surface.order.name(), path.display().to_string());
            return Err(LoadError::Order { place: place("order"), order, file });
        }
        if let Some(wanted) = surface.metric
            && read.mesh.metric != Some(wanted)
        {
            let recorded = |metric: ErrorMetric| format!("--metric {}", metric.name());
            let built = read.mesh.metric.map_or("a metric that it does not record".into(), recorded);
            let (wanted, file) = (wanted.name(), path.display().to_string());
            return Err(LoadError::Metric { place: place("metric"), wanted, file, built });
        }
        let Some(missing) = read.contents.missing() else { return Ok((read.mesh, None)) };
        tracing::warn!("{}: {}: {missing}", place("source"), path.display());
        return Ok((read.mesh, Some(read.contents.whole)));
    }
    let (read, source) = match &surface.source {
        ModelSource::Named(named) => (model::Model::open(named), named.clone()),
        ModelSource::File(path) => (model::Model::load(path), path.display().to_string()),
    };
    let (model, report) = read.map_err(|error| LoadError::Model { place: place("source"), error })?;
    check_coordinates(scene, name, &model.attributes)?;
    report.changes().iter().for_each(|change| tracing::warn!("{source}: {change}"));
    let options = SimplifyOptions {
        metric: surface.metric.unwrap_or(ErrorMetric::Geometry),
        ..SimplifyOptions::default()
    };
    Ok((kept_or_built(&source, &model, &options, surface.order), None))
}
