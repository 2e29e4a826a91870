//! What the figures on orders share: the models, the orders by name, and their costs.

use super::super::cache::{Cache, LevelCosts, level_costs};
use super::super::mesh::ProgressiveMesh;
use super::super::order::{OrderOptions, classical, order};
use super::super::simplify::{Collapses, SimplifyOptions, simplify};
use super::scans;
use crate::figure::{Finding, Row, Table, Value, Verdict};
use crate::model::Model;
use crate::paper::progressive_mesh::choices::FaceOrder;

/// The shipped models that are closed; each has at least 3000 faces.
pub const CLOSED: [&str; 5] = ["bunny", "sphere", "torus", "knot", "solid"];

/// The same and the scans. Means exclude these: they are not available everywhere.
pub const WITH_SCANS: [&str; 7] = ["bunny", "sphere", "torus", "knot", "solid", scans::SMALL, scans::LARGE];

/// The name of an order, and its options; `None` for the classical order.
pub type Named = (&'static str, Option<OrderOptions>);

pub const CLASSICAL: &str = FaceOrder::Classical.name();
pub const PAPER: &str = FaceOrder::Paper.name();
pub const OURS: &str = FaceOrder::Ours.name();
pub const FEW: &str = FaceOrder::OursFewMoves.name();

/// The orders that are prefixes of one buffer at every level.
pub const ORDERS: [Named; 6] = [
    named(FaceOrder::Classical),
    named(FaceOrder::Paper),
    named(FaceOrder::Ours),
    named(FaceOrder::OursFewMoves),
    named(FaceOrder::Coherent),
    named(FaceOrder::CoherentFewMoves),
];

// Quantities of pm.average.
pub const FIFO_16: &str = "FIFO-16";
pub const MOVED: &str = "faces moved or copied per split";
pub const DRAWN: &str = "faces drawn per live face";

const fn named(order: FaceOrder) -> Named {
    (order.name(), OrderOptions::of(order))
}

/// A row whose value is one number.
pub fn number(variant: &str, quantity: impl Into<String>, unit: &str, number: f64) -> Row {
    Row::new(variant, quantity, unit, Value::Number(number))
}

/// A shipped or fetched model and its collapses down to 64 faces.
pub fn simplified(name: &str) -> anyhow::Result<(Model, Collapses)> {
    let model = scans::open(name)?;
    let collapses = simplify(&model, &SimplifyOptions::default(), &mut |_, _| {}).collapses;
    Ok((model, collapses))
}

/// A model in an order.
pub fn ordered(model: &Model, collapses: &Collapses, options: Option<&OrderOptions>) -> ProgressiveMesh {
    match options {
        None => classical(model, collapses),
        Some(options) => order(model, collapses, options, &mut |_, _| {}),
    }
}

/// Faces that change their slots, for each split.
pub fn moved_per_split(mesh: &ProgressiveMesh) -> f64 {
    mesh.swaps.cycles.items().len() as f64 / f64::from(mesh.last_level().max(1))
}

/// The costs for the caches, each at the same levels.
pub fn costs(mesh: &ProgressiveMesh, caches: &[Cache], levels: &[u32]) -> Vec<LevelCosts> {
    level_costs(mesh, caches, levels)
}

/// The mean of a variant's quantity over the scenes at one value of the sweep; `None` unless all of `scenes` have it.
pub fn mean_of(table: &Table, x: Option<f64>, variant: &str, quantity: &str, scenes: &[&str]) -> Option<f64> {
    let numbers: Option<Vec<f64>> =
        scenes.iter().map(|scene| table.number(scene, x, variant, quantity)).collect();
    numbers.map(|numbers| numbers.iter().sum::<f64>() / numbers.len() as f64)
}

/// Reproduced where `met`; not measurable where a number is missing.
pub fn judged(met: Option<bool>, numbers: String, bound: &str) -> Finding {
    match met {
        Some(true) => Finding::new(Verdict::Reproduced, numbers, bound),
        Some(false) => Finding::new(Verdict::NotReproduced, numbers, format!("missed: {bound}")),
        None => Finding::new(Verdict::NotMeasurable, numbers, "not all models were measured"),
    }
}
