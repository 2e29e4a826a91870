//! Every figure of paper 2.

mod average;
mod build;
mod change;
mod continuity;
mod cpu;
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

use crate::figure::{Bench, Figure};
use crate::frame::Run;
use crate::paper::progressive_mesh::{ProgressiveMeshSettings, ProgressiveMeshes, load};
use crate::picture::PixelFormat;
use crate::scene::Scene;
use anyhow::Context;

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
