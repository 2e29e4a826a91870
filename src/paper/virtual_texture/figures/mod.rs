//! All figures and tables of paper 1. Only this module, [`super::extremes`], [`super::trade`] and [`super::counts`] use
//! both the GPU's steps and the reference.

mod address;
pub mod common;
mod compact;
mod cost;
mod dedup;
pub mod extremes;
mod feedback;
mod filtering;
mod headline;
mod limit;
mod pipeline;
pub mod side_by_side;
mod sizes;
mod stages;
mod streaming;

use crate::figure::Figure;

/// All figures, in the order of the report.
pub const FIGURES: &[&Figure] = &[
    &headline::HEADLINE,
    &dedup::DEDUP,
    &compact::COMPACT,
    &pipeline::PIPELINE,
    &sizes::RESOLUTION,
    &sizes::TILE_SIZE,
    &sizes::TEXTURE_SIZE,
    &address::ADDRESS,
    &feedback::FEEDBACK,
    &limit::LIMIT,
    &streaming::CACHE,
    &streaming::BUDGET,
    &streaming::POP,
    &streaming::PREFETCH,
    &streaming::DISK,
    &extremes::EXTREMES_FIGURE,
    &filtering::seams::SEAMS,
    &filtering::filter::FILTER,
    &filtering::na::NA,
];
