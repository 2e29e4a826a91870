//! Parallax mapping with filtering (step H of paper 3): a pixel's colour where a relief moves, deforms and hides parts
//! of its footprint.
//!
//! The paper filters the moved footprint and counts only texels that the relief does not hide; it gives no formula
//! for the offset. Here the rays of the footprint's ends are traced, so its offset and its stretching are exact.
//! Difference: one sweep along the view direction finds the hidden texels by a running maximum of the screen
//! position. The paper traces a ray for each texel and stores those already counted, which gives the same set. In the
//! same sweep, our [`ParallaxFilter::Projected`] weights each texel by its visible width on the screen.
//!
//! The view is parallel, along +x. The ray that shows a point (x, height) enters the top plane at `s = x - (depth -
//! height) cot(elevation)`. The point is hidden if a point before it has a larger s. A pixel is a square of the top
//! plane, `pixel` texels a side; each row of texels is summed along two lines.

use super::reference::first_hit;
use super::{Ray, Relief};

/// How a pixel is filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParallaxFilter {
    /// The texel at the hit of the centre's ray.
    Point,
    /// A plain box filter, moved to where the centre's ray meets the relief: Donnelly's unperturbed derivatives.
    Unperturbed,
    /// All texels between the hits of the pixel's two end rays.
    Whole,
    /// The paper's method: the texels of `Whole` that the relief does not hide.
    Visible,
    /// Each texel, weighted by its visible width.
    Projected,
}

impl ParallaxFilter {
    pub const ALL: [ParallaxFilter; 5] = [
        ParallaxFilter::Point,
        ParallaxFilter::Unperturbed,
        ParallaxFilter::Whole,
        ParallaxFilter::Visible,
        ParallaxFilter::Projected,
    ];

    pub fn name(self) -> &'static str {
        match self {
            ParallaxFilter::Point => "one texel",
            ParallaxFilter::Unperturbed => "unperturbed derivatives",
            ParallaxFilter::Whole => "whole footprint",
            ParallaxFilter::Visible => "visible texels",
            ParallaxFilter::Projected => "projected width",
        }
    }
}

/// The view of a relief.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParallaxView {
    pub elevation_degrees: f64,
    /// Pixels a side.
    pub columns: u32,
    /// Side of a pixel in texels.
    pub pixel: f64,
}

impl ParallaxView {
    pub fn cotangent(&self) -> f64 {
        1.0 / self.elevation_degrees.to_radians().tan()
    }
}

/// The mean colour over `samples` x `samples` rays in each pixel, by exact intersections, row by row.
pub fn truth(relief: &Relief, colours: &[f32], view: &ParallaxView, samples: u32) -> Vec<f64> {
    use rayon::prelude::*;
    let columns = view.columns as usize;
    let step = view.pixel / f64::from(samples);
    let pixel = |at: usize| {
        let corner = [at % columns, at / columns].map(|c| c as f64 * view.pixel);
        let sum: f64 = (0..samples * samples)
            .map(|n| {
                let [s, y] = [(n % samples, 0), (n / samples, 1)]
                    .map(|(n, axis): (u32, usize)| corner[axis] + (f64::from(n) + 0.5) * step);
                let ray = Ray::towards([s as f32, y as f32], view.elevation_degrees, 0.0);
                let x = s + first_hit(relief, &ray) * f64::from(ray.direction[0]);
                bilinear(relief.side, colours, x, y)
            })
            .sum();
        sum / f64::from(samples * samples)
    };
    (0..columns * columns).into_par_iter().map(pixel).collect()
}

fn bilinear(side: usize, values: &[f32], x: f64, y: f64) -> f64 {
    let ([i, j], [fx, fy]) = ([x.floor(), y.floor()], [x - x.floor(), y - y.floor()]);
    let at = |a: i64, b: i64| {
        let wrap = |c: i64| c.rem_euclid(side as i64) as usize;
        f64::from(values[wrap(j as i64 + b) * side + wrap(i as i64 + a)])
    };
    (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy) + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy
}
