//! One of the methods that turn a pixel's footprint into a colour; the GPU and the reference run the same value.

use super::baselines::Baseline;
use super::footprint::{Axes, Determinant, Footprint, Scan};
use super::weight_map::WeightMap;
use super::weights::{Edge, Kernel};

/// What a surface is filtered with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// A…D: weighted texels of an ellipse.
    Ellipse(Ellipse),
    /// The field's.
    Baseline(Baseline),
}

/// A…D together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    pub footprint: Footprint,
    pub kernel: Kernel,
    /// In place of evaluating the kernel.
    pub map: Option<WeightMap>,
    pub edge: Edge,
}

impl Ellipse {
    /// The thesis: no reconstruction term, formula (4) as printed, level 0 but for what one pixel can look at, no edge weights.
    pub const PAPER: Ellipse = Ellipse {
        footprint: Footprint {
            axes: Axes::Rows,
            determinant: Determinant::Subtracting,
            k: 0.0,
            scan: Scan::BoundingBox,
            minor_texels: 0.0,
            most_ratio: 1e6,
        },
        kernel: Kernel::FORMULA_4,
        map: None,
        edge: Edge::None,
    };

    /// Corrected, with everything of ours: the least error per texel of the settings that `tm.pareto` measures.
    pub const BEST: Ellipse = Ellipse {
        footprint: Footprint {
            axes: Axes::Corrected,
            determinant: Determinant::AllPositive,
            k: 0.8,
            scan: Scan::RowSpan,
            minor_texels: 1.0,
            most_ratio: 64.0,
        },
        kernel: Kernel::EWA,
        map: None,
        edge: Edge::AreaRamp,
    };

    /// The largest r of a weight map: texels that the edge cuts have their centres outside of r = 1.
    pub fn map_reach(&self) -> f64 {
        if self.edge == Edge::None { 1.0 } else { 1.5 }
    }

    pub const fn kernel(self, kernel: Kernel) -> Ellipse {
        Ellipse { kernel, ..self }
    }

    pub const fn edge(self, edge: Edge) -> Ellipse {
        Ellipse { edge, ..self }
    }

    pub const fn map(self, map: WeightMap) -> Ellipse {
        Ellipse { map: Some(map), ..self }
    }

    pub const fn minor_texels(self, minor_texels: f32) -> Ellipse {
        Ellipse { footprint: Footprint { minor_texels, ..self.footprint }, ..self }
    }

    pub const fn most_ratio(self, most_ratio: f32) -> Ellipse {
        Ellipse { footprint: Footprint { most_ratio, ..self.footprint }, ..self }
    }

    pub const fn k(self, k: f32) -> Ellipse {
        Ellipse { footprint: Footprint { k, ..self.footprint }, ..self }
    }

    pub const fn axes(self, axes: Axes) -> Ellipse {
        Ellipse { footprint: Footprint { axes, ..self.footprint }, ..self }
    }

    pub const fn scan(self, scan: Scan) -> Ellipse {
        Ellipse { footprint: Footprint { scan, ..self.footprint }, ..self }
    }

    pub const fn determinant(self, determinant: Determinant) -> Ellipse {
        Ellipse { footprint: Footprint { determinant, ..self.footprint }, ..self }
    }
}

/// A pixel as every method gets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Column and row.
    pub place: [u32; 2],
    /// The centre, in texels of level 0.
    pub centre: [f64; 2],
    /// Rows (u_x u_y) and (v_x v_y).
    pub jacobian: [[f64; 2]; 2],
    /// `det J`.
    pub determinant: f64,
}
