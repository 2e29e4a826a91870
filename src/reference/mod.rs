//! The truth: an f64 rasteriser, an f64 texture filter and the distance between surfaces, plain and slow, that share
//! no code with what they check.

mod candidates;
pub mod distance;
pub mod filter;
mod orientation;
pub mod pattern;
pub mod raster;
pub mod supersample;

pub use candidates::Candidates;
pub use raster::{Derivatives, Sample, View, rasterise};
