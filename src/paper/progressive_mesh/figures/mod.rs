//! Every figure of paper 2.

mod average;
mod build;
mod change;
mod continuity;
mod cpu;
mod difference;
mod draw;
mod equal_memory;
mod error;
mod extremes;
mod governor;
mod moves;
mod order;
mod orders;
mod pop;
mod scans;
mod shading;
mod size;
mod surfaces;
mod texture;

use crate::figure::prelude::*;
use crate::frame::Run;
use crate::paper::progressive_mesh::choices::{ErrorMetric, FaceOrder};
use crate::paper::progressive_mesh::config::{self, ProgressiveSurface};
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::{LoadedMesh, ProgressiveMeshSettings, ProgressiveMeshes, load};
use crate::picture::PixelFormat;
use crate::scene::Scene;
use crate::vk::Gpu;

/// All figures, in the report's order.
pub const FIGURES: &[&Figure] = &[
    &order::ORDER,
    &average::AVERAGE,
    &moves::MOVES,
    &cpu::CPU,
    &size::SIZE,
    &build::BUILD,
    &draw::DRAW,
    &change::CHANGE,
    &pop::POP,
    &governor::GOVERNOR,
    &error::ERROR,
    &shading::SHADING,
    &texture::TEXTURE,
    &continuity::CONTINUITY,
    &extremes::EXTREMES,
];

/// A scene with changed settings, and its camera or path. `name` is SCENE/CAMERA or SCENE/PATH.
fn scene<'a>(name: &'a str, changes: &[String]) -> anyhow::Result<(Scene, &'a str)> {
    let (scene, eye) = name.split_once('/').with_context(|| format!("{name:?} is not SCENE/CAMERA"))?;
    Ok((Scene::load_with(scene, changes)?, eye))
}

/// Views of models in the scene `bunny`. Scans are left out unless they have been fetched.
fn models(models: &[&str]) -> Vec<FigureView> {
    seen(&models.iter().map(|model| format!("{model}/near")).collect::<Vec<_>>())
}

/// As [`models`], by MODEL/CAMERA.
fn seen<S: AsRef<str>>(views: &[S]) -> Vec<FigureView> {
    let view = |name: &S| {
        let (model, camera) = name.as_ref().split_once('/')?;
        scans::check_fetched(model).ok()?;
        let source = format!("surface.bunny.geometry.source={model}");
        Some(FigureView::new(name.as_ref(), &format!("bunny/{camera}"), [source]))
    };
    views.iter().filter_map(view).collect()
}

/// The orders of faces as settings of the scene `bunny`.
fn face_orders() -> Vec<Setting> {
    let order = |name| Setting::new(name, [format!("surface.bunny.geometry.order={name}")]);
    FaceOrder::ALL.iter().map(|one| order(one.name())).collect()
}

/// Names of the two metrics, as settings of the scene `bunny`.
fn metrics(names: [&str; 2]) -> Vec<Setting> {
    let metrics = names.into_iter().zip([ErrorMetric::Geometry, ErrorMetric::Appearance]);
    let change = |metric: ErrorMetric| [format!("surface.bunny.geometry.metric={}", metric.name())];
    metrics.map(|(name, metric)| Setting::new(name, change(metric))).collect()
}

/// A session of a scene on the run's device. `change` edits the settings last.
fn session(
    bench: &Bench,
    scene: &Scene,
    change: impl FnOnce(&mut ProgressiveMeshSettings),
) -> anyhow::Result<Run<ProgressiveMeshes>> {
    let mut settings = ProgressiveMeshSettings::of_scene(scene, PixelFormat::Srgb8)?;
    settings.size = bench.effort_of([320, 180], [1280, 720]);
    change(&mut settings);
    let gpu = bench.gpu(&[])?;
    Ok(ProgressiveMeshes::run(gpu, &load(scene)?, settings)?)
}

/// A session of the scene `bunny` with one instance of another mesh. `change` edits the surface last.
fn session_of(
    gpu: &Gpu,
    mesh: &ProgressiveMesh,
    size: [u32; 2],
    change: impl FnOnce(&mut ProgressiveSurface),
) -> anyhow::Result<Run<ProgressiveMeshes>> {
    let scene = Scene::embedded("bunny")?;
    let mut surface = config::surface(&scene, "bunny")?;
    change(&mut surface);
    let model = LoadedMesh::new(&scene, "bunny", surface, mesh.clone());
    let settings =
        ProgressiveMeshSettings { size, ..ProgressiveMeshSettings::of_scene(&scene, PixelFormat::Srgb8)? };
    Ok(ProgressiveMeshes::run(gpu.clone(), &[model], settings)?)
}
