//! The weight of a texel (steps B and C). r is the texel's distance from the footprint's centre, in units in which the
//! ellipse's edge is at 1.
//!
//! Step B is formula (4), `W = exp(-alpha r^2)`, along the axes of [`Axes`](super::footprint::Axes). The thesis prints
//! no sigma for formula (4). We use that of step C's Gaussian solid (diameter 1, sigma 0.2): 0.4 of the support's
//! radius. The radius can be read as one pixel or as half a pixel (see [`EllipseKernel`]).
//!
//! If the ellipse's edge cuts a texel, step C weights the texel by `V1(d) = Phi(d / 0.2)`. This is the part of the
//! solid's volume (sigma 0.2 texels) that lies on the inner side of the cut. Here d is the signed distance in texels
//! from the texel's centre to the edge, positive inside. Texels with `d > -1/2` contribute.

/// A footprint is empty if the sum of its weights is below 2^-100. f32 loses weights below 2^-126, some devices all
/// subnormal ones, so a smaller sum would have a device-dependent mean.
pub const MIN_WEIGHTS: f64 = 7.888609052210118e-31;

/// The Gaussian's support in the picture plane and its fall-off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipseKernel {
    /// Pixels from the centre to r = 1.
    pub radius_px: f32,
    /// `W = exp(-alpha r^2)`; with 0 every texel of the ellipse has the same weight.
    pub alpha: f32,
}

/// How much of a texel counts if the ellipse's edge cuts the texel (step C).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// A texel counts as a whole if its centre is inside the ellipse.
    None,
    /// `Phi(d / 0.2)`.
    Exact,
    /// `0.5 + 2.151 d - 2.358 d^2`.
    Quadratic,
    /// `0.496 + 2.288 d - 3.074 d^2 + 0.956 d^3`.
    Cubic,
    /// Three pieces.
    PiecewiseLinear,
    /// `0.5 + d`, the covered area of the texel. This is the control, which the thesis calls inadequate.
    AreaRamp,
}

impl EllipseKernel {
    /// Formula (4) with sigma 0.4 of the support's radius, as in step C's solid. The radius is one pixel.
    pub const FORMULA_4: EllipseKernel = EllipseKernel { radius_px: 1.0, alpha: 3.125 };
    /// The other reading of formula (4): the support's diameter is one pixel. This kernel hardly antialiases.
    pub const DIAMETER_1: EllipseKernel = EllipseKernel { radius_px: 0.5, alpha: 3.125 };
    /// Sigma 0.5 pixels, cut at r = 1: the usual EWA filter (Heckbert 1989; pbrt).
    pub const EWA: EllipseKernel = EllipseKernel { radius_px: 1.0, alpha: 2.0 };
    /// Equal weights.
    pub const UNIFORM: EllipseKernel = EllipseKernel { radius_px: 1.0, alpha: 0.0 };

    /// Variance of the normalised kernel along each axis for a radius of 1: the weighted mean of r^2 / 2 over the
    /// disc.
    pub fn variance(self) -> f64 {
        let alpha = f64::from(self.alpha);
        if alpha == 0.0 {
            return 0.25;
        }
        let cut = (-alpha).exp();
        (1.0 - alpha * cut / (1.0 - cut)) / (2.0 * alpha)
    }
}

impl Edge {
    pub const ALL: [Edge; 6] =
        [Edge::None, Edge::Exact, Edge::Quadratic, Edge::Cubic, Edge::PiecewiseLinear, Edge::AreaRamp];

    pub fn name(self) -> &'static str {
        match self {
            Edge::None => "none",
            Edge::Exact => "exact",
            Edge::Quadratic => "quadratic",
            Edge::Cubic => "cubic",
            Edge::PiecewiseLinear => "piecewise linear",
            Edge::AreaRamp => "area ramp",
        }
    }
}
