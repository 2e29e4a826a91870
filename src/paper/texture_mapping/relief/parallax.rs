//! Parallax mapping with filtering (step H of paper 3): a pixel's colour where a relief moves, deforms and hides parts
//! of its footprint.
//!
//! The paper filters the moved footprint and counts only texels that the relief does not hide; the paper gives no
//! formula for the offset. Here the rays of the footprint's two ends are traced, so the offset and the stretching of
//! the footprint are exact. Difference: one sweep along the view direction finds the hidden texels by a running maximum
//! of the screen position. The paper traces a ray for each texel and stores which texels are already counted; both
//! methods find the same set of texels. In the same sweep, our [`ParallaxFilter::Projected`] weights each texel by its
//! visible width on the screen.
//!
//! The view is parallel, along +x. The ray that shows a point (x, height) enters the top plane at `s = x - (depth -
//! height) cot(elevation)`. The point is hidden if a point with a smaller x has a larger s. A pixel is a square of the
//! top plane, `pixel` texels a side. Its texels are summed along lines parallel to x, two for each row of texels.

use super::reference::first_hit;
use super::{Ray, Relief};
use crate::reference::supersample::{Density, PixelKernel, Truth, supersample};

/// How a pixel is filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParallaxFilter {
    /// The texel at the hit of the centre's ray.
    Point,
    /// A plain box filter, moved by the height below the pixel's centre: parallax mapping without tracing (T. Kaneko et
    /// al., "Detailed Shape Representation with Parallax Mapping", ICAT 2001).
    Offset,
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
    pub const ALL: [ParallaxFilter; 6] = [
        ParallaxFilter::Point,
        ParallaxFilter::Offset,
        ParallaxFilter::Unperturbed,
        ParallaxFilter::Whole,
        ParallaxFilter::Visible,
        ParallaxFilter::Projected,
    ];

    pub fn name(self) -> &'static str {
        match self {
            ParallaxFilter::Point => "one texel",
            ParallaxFilter::Offset => "offset",
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

/// The mean colour of rays with exact intersections: two in each of `strata` x `strata` parts of a pixel.
pub fn truth(relief: &Relief, colours: &[f32], view: &ParallaxView, strata: u32) -> Truth {
    let hit = |x: f64, y: f64| {
        let [s, y] = [x, y].map(|at| at * view.pixel);
        let ray = Ray::towards([s as f32, y as f32], view.elevation_degrees, 0.0);
        Some([s + first_hit(relief, &ray) * f64::from(ray.direction[0]), y])
    };
    let colour = |[x, y]: [f64; 2]| bilinear(relief.side, colours, x, y);
    let density = Density { per_texel: 0.0, min: strata, max: strata };
    supersample([view.columns; 2], hit, colour, PixelKernel::Box, density)
}

fn bilinear(side: usize, values: &[f32], x: f64, y: f64) -> f64 {
    let ([i, j], [fx, fy]) = ([x.floor(), y.floor()], [x - x.floor(), y - y.floor()]);
    let at = |a: i64, b: i64| {
        let wrap = |c: i64| c.rem_euclid(side as i64) as usize;
        f64::from(values[wrap(j as i64 + b) * side + wrap(i as i64 + a)])
    };
    (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy) + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy
}
