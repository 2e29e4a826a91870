//! The methods that filter a pixel's footprint to a colour; the GPU and the reference take the same [`Method`].

use super::baselines::FilterBaseline;
use super::footprint::{Axes, Determinant, FootprintSettings, KTexels, MAX_REACH, Scan};
use super::weights::{Edge, EllipseKernel};
use crate::math::weight_map::{WeightMap, map_reach};

/// A filter method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Weighted texels of an ellipse (steps A to D of [`super`]).
    Ellipse(EllipseFilter),
    /// A published filter.
    Baseline(FilterBaseline),
    /// Object-space texturing (step G): fragments of rotated polygons. The value is the spacing of the fragments in
    /// pixels.
    ObjectSpace(f32),
}

impl Method {
    /// True if the determinant is a difference, which cancels to noise in f32 for long footprints. No reference applies
    /// to such methods.
    pub fn subtracts(&self) -> bool {
        matches!(self, Method::Ellipse(ellipse) if ellipse.footprint.determinant == Determinant::Subtracting)
    }
}

/// The settings of [`Method::Ellipse`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipseFilter {
    pub footprint: FootprintSettings,
    pub kernel: EllipseKernel,
    /// A table that replaces the evaluation of the kernel.
    pub map: Option<WeightMap>,
    pub edge: Edge,
}

impl EllipseFilter {
    /// The thesis's settings: no reconstruction term, formula (4) as printed, level 0 unless a pixel would visit too
    /// many texels, no edge weights.
    pub const PAPER: EllipseFilter = EllipseFilter {
        footprint: FootprintSettings {
            axes: Axes::Rows,
            determinant: Determinant::Subtracting,
            k: 0.0,
            k_texels: KTexels::OfLevel,
            scan: Scan::BoundingBox,
            minor_texels: 0.0,
            max_ratio: 1e6,
            max_reach: MAX_REACH,
        },
        kernel: EllipseKernel::FORMULA_4,
        map: None,
        edge: Edge::None,
    };

    /// The corrected formulas with all of our additions. In `tm.pareto`, twice the texels across the ellipse would
    /// reduce the error by only 5 %.
    pub const BEST: EllipseFilter = EllipseFilter {
        footprint: FootprintSettings {
            axes: Axes::Corrected,
            determinant: Determinant::AllPositive,
            k: 0.8,
            k_texels: KTexels::OfLevel0,
            scan: Scan::RowSpan,
            minor_texels: 1.0,
            max_ratio: 64.0,
            max_reach: MAX_REACH,
        },
        kernel: EllipseKernel::EWA,
        map: None,
        edge: Edge::AreaRamp,
    };

    /// The largest r in the weight map.
    pub fn map_reach(&self) -> f64 {
        map_reach(self.edge != Edge::None)
    }

    pub const fn kernel(self, kernel: EllipseKernel) -> EllipseFilter {
        EllipseFilter { kernel, ..self }
    }

    pub const fn edge(self, edge: Edge) -> EllipseFilter {
        EllipseFilter { edge, ..self }
    }

    pub const fn map(self, map: WeightMap) -> EllipseFilter {
        EllipseFilter { map: Some(map), ..self }
    }

    pub const fn minor_texels(self, minor_texels: f32) -> EllipseFilter {
        EllipseFilter { footprint: FootprintSettings { minor_texels, ..self.footprint }, ..self }
    }

    pub const fn max_ratio(self, max_ratio: f32) -> EllipseFilter {
        EllipseFilter { footprint: FootprintSettings { max_ratio, ..self.footprint }, ..self }
    }

    /// Limits the footprint. Including half a texel at the edge, the footprint then reaches at most `texels` from the
    /// texel that contains its centre. For a tiled texture, `texels` is half a tile. The limit depends on k, the edge
    /// and the axis ratio, so it must be set after these.
    ///
    /// Let V be the ellipse's matrix, k included, and I the identity. The half texel at the edge adds at most `V / t +
    /// ((1 + t) / 4) I` to V, where t is twice the minor semi-axis (`outer` in `reference/ellipse.rs`). The minor
    /// semi-axis is at least `sqrt k`, and the term is at most k ([`FootprintSettings::k_at`]). For a small k this
    /// bound is too weak, and the axis ratio r bounds the growth instead: if h is half a side of the bounding box, `2 h
    /// / r <= t <= 2 h`. Without edge weights, V grows only by a margin of 1e-4.
    pub fn within(self, texels: u32) -> EllipseFilter {
        let (k, max) = (f64::from(self.footprint.k), f64::from(texels) - 0.5);
        let half_side_squared = if k >= 0.25 {
            let t = 2.0 * k.sqrt();
            (max * max - (1.0 + t) / 4.0) / (1.0 + 1.0 / t)
        } else if self.edge == Edge::None {
            max * max / 1.0001
        } else {
            let c = (f64::from(self.footprint.max_ratio) + 1.0) / 4.0;
            ((c * c + max * max - 0.25).sqrt() - c).powi(2)
        };
        let max_reach = (half_side_squared - k).sqrt() as f32;
        EllipseFilter { footprint: FootprintSettings { max_reach, ..self.footprint }, ..self }
    }

    pub const fn k(self, k: f32) -> EllipseFilter {
        EllipseFilter { footprint: FootprintSettings { k, ..self.footprint }, ..self }
    }

    pub const fn k_texels(self, k_texels: KTexels) -> EllipseFilter {
        EllipseFilter { footprint: FootprintSettings { k_texels, ..self.footprint }, ..self }
    }

    pub const fn axes(self, axes: Axes) -> EllipseFilter {
        EllipseFilter { footprint: FootprintSettings { axes, ..self.footprint }, ..self }
    }

    pub const fn scan(self, scan: Scan) -> EllipseFilter {
        EllipseFilter { footprint: FootprintSettings { scan, ..self.footprint }, ..self }
    }

    pub const fn determinant(self, determinant: Determinant) -> EllipseFilter {
        EllipseFilter { footprint: FootprintSettings { determinant, ..self.footprint }, ..self }
    }
}

/// How a pixel's position and derivatives are computed for an ellipse (steps E and F of [`super`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// The homography's nine coefficients give the position and the exact derivatives at the pixel's centre.
    Analytic,
    /// The nine coefficients give the positions of the pixel and of its right and lower neighbours. Derivatives are
    /// differences.
    Textbook,
    /// The constants of the row of pixels give the pixel's position; additions give the positions of its neighbours.
    /// Derivatives are differences.
    Rows,
    /// The constants of the row give the position. Formula (9) gives the ellipse's parameters from these constants.
    Incremental,
}

/// A pixel, as passed to every method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelCentre {
    /// Column and row.
    pub place: [u32; 2],
    /// The centre, in texels of level 0.
    pub centre: [f64; 2],
    /// Rows (u_x u_y) and (v_x v_y).
    pub jacobian: [[f64; 2]; 2],
    /// `det J`.
    pub determinant: f64,
}
