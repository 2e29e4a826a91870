//! Every figure of paper 3.

mod anisotropic;
mod coordinates;
mod drift;
mod edges;
mod extremes;
mod lab;
mod map_error;
mod methods;
mod object_space;
mod parallax;
mod pareto;
mod patterns;
mod relief;
mod shape;
mod shown;
mod temporal;

use crate::figure::Figure;

/// The figures, in the order of the report.
pub const FIGURES: &[&Figure] = &[
    &coordinates::COORDINATES,
    &anisotropic::ANISOTROPIC,
    &drift::DRIFT,
    &object_space::OBJECT_SPACE_TEXTURING,
    &shape::SHAPE,
    &edges::EDGES,
    &parallax::PARALLAX,
    &relief::RELIEF,
    &relief::MAP_BUILD,
    &pareto::PARETO,
    &patterns::PATTERNS,
    &extremes::EXTREMES,
    &temporal::TEMPORAL,
];
