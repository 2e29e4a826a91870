//! The reference ("truth"): an f64 rasteriser, an f64 texture filter and the distance between surfaces.
//! Simple, slow, and without any code shared with what they check.

mod candidates;
pub mod cylinder;
pub mod distance;
pub mod ellipsoid;
pub mod filter;
mod orientation;
pub mod pattern;
pub mod raster;
pub mod supersample;

pub use candidates::Candidates;
pub use raster::{Derivatives, ReferenceView, Sample, rasterise};
