//! The truth: an f64 rasteriser and an f64 texture filter, plain and slow, that share no code with what
//! they check.

mod candidates;
pub mod filter;
mod orientation;
pub mod raster;

pub use candidates::Candidates;
pub use raster::{Derivatives, Sample, View, rasterise};
