//! Every figure and table of paper 1: the only place that sees both the GPU's steps and the reference.

pub mod common;
mod feedback;
mod streaming;

use crate::figure::Figure;

/// In the order of the report.
pub const FIGURES: &[&Figure] = &[
    &feedback::FEEDBACK,
    &streaming::CACHE,
    &streaming::BUDGET,
    &streaming::POP,
    &streaming::PREFETCH,
    &streaming::DISK,
];
