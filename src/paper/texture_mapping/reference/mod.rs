//! Every method in f64 on the CPU, written from the papers. The functions have the same names as the shaders'
//! functions, but share no code with them.

pub mod baselines;
pub mod ellipse;

use super::baselines::FilterBaseline;
use super::method::{Method, PixelCentre};
use super::texels::GreyMipmap;
use crate::reference::filter::SAMPLER_ERROR;
use baselines::Texture;

/// A pixel's filtered value with an error bound for the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilteredTexel {
    pub value: f64,
    /// Largest effect of rounding to f32.
    pub slack: f64,
    /// Texels with a weight.
    pub fetched: u32,
    /// Texels for which rounding decides whether they have a weight.
    pub undecided: u32,
    /// True if no texel had a weight; the value is then the nearest texel's.
    pub empty: bool,
}

/// The levels that a method may choose. The two entries differ if rounding decides between two levels. Methods that mix
/// levels return `[0, 0]`.
pub fn levels(method: &Method, pixel: &PixelCentre, texels: &GreyMipmap) -> [u32; 2] {
    match method {
        Method::Ellipse(ellipse) => ellipse::levels(ellipse, pixel, texels.coarsest()),
        Method::Baseline(FilterBaseline::Stochastic(_)) => {
            with_sampler(texels, |texture| baselines::stochastic_levels(pixel, texture))
        }
        Method::Baseline(_) | Method::ObjectSpace(_) => [0; 2],
    }
}

/// A pixel's value at one of its [`levels`]; `None` if only the device can compute it. `frame` seeds random
/// numbers.
pub fn filtered(
    method: &Method,
    pixel: &PixelCentre,
    texels: &GreyMipmap,
    level: u32,
    frame: u32,
) -> Option<FilteredTexel> {
    match method {
        Method::Ellipse(ellipse) => {
            let value = |column, row| f64::from(texels.byte(level, column, row)) / 255.0;
            Some(ellipse::filtered(ellipse, pixel, [level, texels.coarsest()], value))
        }
        Method::Baseline(baseline) => {
            with_sampler(texels, |texture| baselines::filtered(*baseline, pixel, texture, level, frame))
        }
        // An object-space pixel depends on the whole picture: `object_space::reference` computes it.
        Method::ObjectSpace(_) => None,
    }
}

/// The texture as the figures read it: repeated over the plane, and read by a sampler.
fn with_sampler<T>(texels: &GreyMipmap, with: impl FnOnce(&Texture<'_>) -> T) -> T {
    let texel = |level, column, row| f64::from(texels.byte(level, column, row)) / 255.0;
    with(&Texture {
        coarsest: texels.coarsest(),
        texel: &texel,
        max_reach: f64::INFINITY,
        place_error: 0.0,
        sample_error: SAMPLER_ERROR,
    })
}
