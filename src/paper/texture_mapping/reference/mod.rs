//! Every method in f64 on the CPU, written from the paper: the same names, none of the GPU's code.

pub mod baselines;
pub mod ellipse;

use super::baselines::Baseline;
use super::method::{Method, Pixel};
use super::texels::Texels;

/// A pixel's filtered value, and what the GPU may differ by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Filtered {
    pub value: f64,
    /// What rounding to f32 may change, at most.
    pub slack: f64,
    /// Texels with a weight.
    pub fetched: u32,
    /// Texels of which rounding decides whether they have one.
    pub undecided: u32,
    /// No texel had a weight; the value is the nearest texel's.
    pub empty: bool,
}

/// The levels that a method may choose: two where rounding decides; of methods that mix levels 0.
pub fn levels(method: &Method, pixel: &Pixel, texels: &Texels) -> [u32; 2] {
    match method {
        Method::Ellipse(ellipse) => ellipse::levels(ellipse, pixel, texels.coarsest()),
        Method::Baseline(Baseline::Stochastic(_)) => baselines::stochastic_levels(pixel, texels),
        Method::Baseline(_) => [0; 2],
    }
}

/// A pixel's value at one of its [`levels`]; `None` for what only the device knows. `frame` decides random
/// numbers.
pub fn filtered(method: &Method, pixel: &Pixel, texels: &Texels, level: u32, frame: u32) -> Option<Filtered> {
    match method {
        Method::Ellipse(ellipse) => Some(ellipse::filtered(ellipse, pixel, texels, level)),
        Method::Baseline(baseline) => baselines::filtered(*baseline, pixel, texels, level, frame),
    }
}
