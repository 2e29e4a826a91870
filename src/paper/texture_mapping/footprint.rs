//! A: the footprint. The disc `r <= 1` of a pixel maps to the ellipse `q^T V^-1 q <= 1` in texels around the pixel's centre,
//! `V = J J^T`: the thesis's (1)…(3), Heckbert's "Fundamentals of texture mapping and image warping" (UCB/CSD 89/516, 1989).
//!
//! Ours: `V = s J J^T + k I` with a reconstruction term k, whose determinant has positive terms alone; the level of detail
//! by the minor axis; a cap on the ratio of the axes.

/// Which ellipse the weights (4) follow. The texels that take part are always those of the exact ellipse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// As printed: axes as long as the rows of J, turned by the angle of the first row.
    Rows,
    /// As printed, with J's columns in place of its rows.
    Columns,
    /// Exact for every J.
    Corrected,
    /// A circle as wide as the exact major axis is long: weights that are blind to the shape.
    Round,
}

/// How `det V` is computed; it decides whether long footprints exist in f32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Determinant {
    /// `s^2 (det J)^2 + s k tr(J J^T) + k^2`.
    AllPositive,
    /// `V11 V22 - V12^2`, which cancels: not positive for a quarter of all directions at an axis ratio of 10^4.
    Subtracting,
}

/// Which texels are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scan {
    /// All of the ellipse's bounding box.
    BoundingBox,
    /// Each row from the ellipse's left edge to its right one.
    RowSpan,
}

/// Everything about A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    pub axes: Axes,
    pub determinant: Determinant,
    /// The reconstruction term, in squared texels of the level that is filtered; the thesis has 0. At least 1/2 leaves no
    /// footprint without a texel: a disc of that squared radius holds one wherever it lies.
    pub k: f32,
    pub scan: Scan,
    /// The finest level is taken in which the minor semi-axis has less than twice so many texels; 0: always level 0.
    pub minor_texels: f32,
    /// A longer ellipse is widened to this ratio of its axes.
    pub most_ratio: f32,
}

/// Most texels that one pixel looks at, and half of the most rows: beyond, the level is raised.
pub const MOST_VISITED: u32 = 16_384;
pub const MOST_REACH: u32 = 1024;

/// A semi-axis of more texels sees the texture's mean: the coarsest level's texel.
pub const MOST_MAJOR_TEXELS: f64 = 1_048_576.0;
