//! Every figure of paper 3: the only place that sees both the GPU's steps and the reference.

pub mod agreement;
mod edges;
mod extremes;
mod lab;
mod methods;
mod pareto;
mod shape;
mod temporal;

use crate::figure::Figure;

/// In the order of the report.
pub const FIGURES: &[&Figure] =
    &[&shape::SHAPE, &edges::EDGES, &pareto::PARETO, &extremes::EXTREMES, &temporal::TEMPORAL];
