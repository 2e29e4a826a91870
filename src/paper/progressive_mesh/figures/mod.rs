//! Every figure of paper 2.

mod average;
mod build;
mod change;
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
mod size;
mod surfaces;

use crate::figure::{Bench, Effort, Figure};
use crate::frame::Run;
use crate::paper::progressive_mesh::{ProgressiveMeshes, Settings, load, needs};
use crate::picture::Target;
use crate::scene::Scene;
use anyhow::Context;

/// All of them, in the order of a report.
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
    &extremes::EXTREMES,
];

/// A scene with changes; `name` is SCENE/CAMERA or SCENE/PATH.
fn scene<'a>(name: &'a str, changes: &[String]) -> anyhow::Result<(Scene, &'a str)> {
    let (scene, eye) = name.split_once('/').with_context(|| format!("{name:?} is no SCENE/CAMERA"))?;
    Ok((Scene::load_with(scene, changes)?, eye))
}

/// A session of a scene on the run's device; `change` has the last word on the settings.
fn session(
    bench: &Bench,
    scene: &Scene,
    change: impl FnOnce(&mut Settings),
) -> anyhow::Result<Run<ProgressiveMeshes>> {
    let mut settings = Settings::of_scene(scene, Target::Srgb8)?;
    settings.size = match bench.effort {
        Effort::Quick => [320, 180],
        Effort::Full => [1280, 720],
    };
    change(&mut settings);
    let gpu = bench.gpu(&needs(&settings))?;
    Ok(ProgressiveMeshes::run(gpu, &load(scene)?, settings)?)
}

/// Three digits: 0.0123, 1.23, 12.3, 123, 1234.
fn short(number: f64) -> String {
    if number == 0.0 || !number.is_finite() {
        return format!("{number}");
    }
    let digits = (2 - number.abs().log10().floor() as i32).clamp(0, 6);
    format!("{number:.*}", digits as usize)
}

#[cfg(test)]
mod tests {
    use crate::figure::{Machine, Record, Row, Table, Value};

    /// A table of numbers: (scene, variant, quantity, number).
    pub fn table(device_kind: &str, numbers: &[(&str, &str, &str, f64)]) -> Table {
        let record = |&(scene, variant, quantity, number): &(&str, &str, &str, f64)| Record {
            scene: scene.into(),
            x: None,
            row: Row::new(variant, quantity, "", Value::Number(number)),
        };
        let machine = Machine {
            device: "Some device".into(),
            device_kind: device_kind.into(),
            driver: String::new(),
            vulkan: "1.3".into(),
            processor: String::new(),
            cores: 2,
            commit: String::new(),
            date: "2026-11-21".into(),
        };
        Table { machine, records: numbers.iter().map(record).collect(), missing: 0 }
    }
}
