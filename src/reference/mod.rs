//! The reference ("truth"): an f64 rasteriser, an f64 texture filter and the distance between surfaces.
//! It is simple and slow, and shares no code with what it checks.

mod candidates;
pub mod cylinder;
mod dense;
pub mod distance;
pub mod ellipsoid;
pub mod filter;
mod orientation;
pub mod pattern;
pub mod raster;
pub mod supersample;

pub use candidates::Candidates;
pub use dense::PixelTriangles;
pub use raster::{Derivatives, ReferenceView, Sample, rasterise};
