//! Shared by the figures on orders: the models, the orders by name, and their costs.

use super::super::baselines::BASELINES;
use super::super::check::MeshFlaw;
use super::super::keep;
use super::super::mesh::ProgressiveMesh;
use super::super::order::{OrderOptions, order_or_classical};
use super::super::run::Program;
use super::super::simplify::{Collapses, SimplifyOptions, simplify};
use super::scans;
use crate::figure::Row;
use crate::model::Model;
use crate::paper::progressive_mesh::choices::{BuildEffort, FaceOrder};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// The shipped closed models; each has at least 3000 faces.
pub const CLOSED: [&str; 5] = ["bunny", "sphere", "torus", "knot", "solid"];

/// The closed models and the scans. Means exclude the scans, because they are not available everywhere.
pub const WITH_SCANS: [&str; 7] = ["bunny", "sphere", "torus", "knot", "solid", scans::SMALL, scans::LARGE];

/// The name of an order, and its options; `None` for the classical order.
pub type NamedOrder = (&'static str, Option<OrderOptions>);

pub const CLASSICAL: &str = FaceOrder::Classical.name();
pub const PAPER: &str = FaceOrder::Paper.name();
pub const TAIL_23: &str = FaceOrder::Tail23.name();
pub const TAIL_10: &str = FaceOrder::Tail10.name();
pub const IN_PLACE_23: &str = FaceOrder::InPlace23.name();
pub const IN_PLACE_10: &str = FaceOrder::InPlace10.name();

/// The orders that draw a prefix of one buffer at every level.
pub const ORDERS: [NamedOrder; 6] = [
    named(FaceOrder::Classical),
    named(FaceOrder::Paper),
    named(FaceOrder::Tail23),
    named(FaceOrder::Tail10),
    named(FaceOrder::InPlace23),
    named(FaceOrder::InPlace10),
];

// Quantities of pm.average.
pub const FIFO_16: &str = "FIFO-16";
pub const MOVED: &str = "faces moved or copied per split";
pub const DRAWN: &str = "faces drawn per live face";

const fn named(order: FaceOrder) -> NamedOrder {
    (order.name(), OrderOptions::of(order))
}

/// The names of all orders and baselines.
pub fn orders_and_baselines() -> Vec<String> {
    let baselines = BASELINES.iter().map(|baseline| baseline.name());
    ORDERS.iter().map(|(name, _)| *name).chain(baselines).map(str::to_owned).collect()
}

/// A row whose value is one number.
pub fn number(variant: &str, quantity: impl Into<String>, unit: &str, number: f64) -> Row {
    Row::number(variant, quantity, unit, number)
}

/// A mesh in an order, and the program that executes its levels.
pub struct Executable {
    pub mesh: ProgressiveMesh,
    pub program: Program,
}

impl Executable {
    /// # Errors
    /// The mesh cannot be executed, which is a bug of the order.
    pub fn new(mesh: ProgressiveMesh) -> Result<Executable, MeshFlaw> {
        Ok(Executable { program: Program::new(&mesh)?, mesh })
    }
}

/// A shipped or fetched model and its collapses down to 64 faces.
pub fn simplified(name: &str) -> anyhow::Result<(Model, Arc<Collapses>)> {
    simplified_with(name, BuildEffort::Best)
}

/// As [`simplified`], with another effort.
pub fn simplified_with(name: &str, effort: BuildEffort) -> anyhow::Result<(Model, Arc<Collapses>)> {
    let model = scans::open(name)?;
    let collapses = collapses(&model, &SimplifyOptions { effort, ..SimplifyOptions::default() });
    Ok((model, collapses))
}

/// Maximum number of faces of a model whose collapses are kept. They take about 20 bytes per face.
const KEPT_FACES: usize = 50_000;

/// The collapses of a model. Many cells simplify the same models, so the collapses of small models are kept until the
/// process ends.
pub fn collapses(model: &Model, options: &SimplifyOptions) -> Arc<Collapses> {
    static KEPT: Mutex<BTreeMap<String, Arc<Collapses>>> = Mutex::new(BTreeMap::new());
    let kept = || KEPT.lock().expect("no thread panics while it holds the lock");
    let name = keep::file_name(model, options, FaceOrder::Classical);
    if let Some(known) = kept().get(&name) {
        return known.clone();
    }
    let collapses = Arc::new(simplify(model, options, &mut |_, _| {}).collapses);
    if model.faces.len() <= KEPT_FACES {
        kept().insert(name, collapses.clone());
    }
    collapses
}

/// A model in an order.
pub fn ordered(model: &Model, collapses: &Collapses, options: Option<&OrderOptions>) -> ProgressiveMesh {
    order_or_classical(model, collapses, options, &mut |_, _| {})
}

/// A model in each of [`ORDERS`], by name. The orders are made in parallel, and all meshes are in memory.
pub fn every_order(model: &Model, collapses: &Collapses) -> Vec<(&'static str, ProgressiveMesh)> {
    let of = |(name, options): &NamedOrder| (*name, ordered(model, collapses, options.as_ref()));
    ORDERS.par_iter().map(of).collect()
}

/// Faces that change their slots, per split.
pub fn moved_per_split(mesh: &ProgressiveMesh) -> f64 {
    mesh.swaps.cycles.items().len() as f64 / f64::from(mesh.last_level().max(1))
}
