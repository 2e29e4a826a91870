//! Every figure of paper 3: the only place that sees both the GPU's steps and the reference.

mod contender;
mod coordinates;
mod drift;
mod parallax;
mod relief;

use crate::figure::Figure;

/// In the order of the report.
pub const FIGURES: &[&Figure] =
    &[&coordinates::COORDINATES, &drift::DRIFT, &parallax::PARALLAX, &relief::RELIEF, &relief::MAP_BUILD];
