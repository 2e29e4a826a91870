//! The footprint (step A). The disc `r <= 1` of a pixel maps to the ellipse `q^T V^-1 q <= 1` in texels around the
//! pixel's centre, with `V = J J^T` and the Jacobian J. These are formulas (1) to (3) of the thesis (Heckbert,
//! "Fundamentals of texture mapping and image warping", UCB/CSD 89/516, 1989).
//!
//! Our matrix is `V = s J J^T + k I` with the kernel's squared radius s and a reconstruction term k. We compute `det V`
//! from positive terms only. The minor axis selects the level of detail, and the axis ratio is limited. The term
//! interpolates the texture's own texels, so k is measured in texels of level 0: 0.8 has about the blur of bilinear
//! interpolation. A coarser level approximates the same kernel and adds no blur of its own texels, which are means
//! already.

/// The ellipse that the weights of formula (4) follow. The contributing texels are always the texels of the exact
/// ellipse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// As the thesis prints them: axis lengths from the rows of J, rotated by the angle of the first row.
    Rows,
    /// As `Rows`, with the columns of J in place of the rows.
    Columns,
    /// Exact for every J.
    Corrected,
    /// A circle with the radius of the exact major axis.
    Round,
}

/// The formula for `det V`. It decides whether long footprints work in f32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Determinant {
    /// `s^2 (det J)^2 + s k tr(J J^T) + k^2`.
    AllPositive,
    /// `V11 V22 - V12^2`. Its terms cancel: at an axis ratio of 10^4, the result is not positive for a
    /// quarter of all directions.
    Subtracting,
}

/// The texels that are visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scan {
    /// The ellipse's whole bounding box.
    BoundingBox,
    /// In each row, the texels from the ellipse's left edge to its right edge.
    RowSpan,
}

/// The texels in which the reconstruction term k is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KTexels {
    /// Those of the filtered level. This blurs every level by its own texels.
    OfLevel,
    /// Those of level 0. In a coarser level, a squared minor semi-axis that would be shorter than k squared texels of
    /// that level is lengthened to k. Only ellipses whose level is raised for their number of texels or their reach, or
    /// with `minor_texels` below the square root of k, are so short.
    OfLevel0,
}

/// All settings of the footprint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootprintSettings {
    pub axes: Axes,
    pub determinant: Determinant,
    /// The reconstruction term, in squared texels; the thesis has 0. If k is at least 1/2, every footprint contains a
    /// texel's centre, because a disc of squared radius 1/2 contains a texel's centre at every position.
    pub k: f32,
    pub k_texels: KTexels,
    pub scan: Scan,
    /// Selects the finest level on which the minor semi-axis is shorter than twice this number of texels. The value 0
    /// always selects level 0.
    pub minor_texels: f32,
    /// An ellipse with a greater axis ratio is widened to this ratio.
    pub max_ratio: f32,
    /// Maximum distance from the centre to a side of the ellipse's bounding box, in texels of the level. The ellipse is
    /// taken without k. A larger box raises the level.
    pub max_reach: f32,
}

/// The most texels that a pixel visits; a larger footprint raises the level.
pub const MAX_VISITED: u32 = 16_384;

/// [`FootprintSettings::max_reach`] for a texture that is whole in video memory, not split into tiles.
pub const MAX_REACH: f32 = 1024.0;

/// If the longer semi-axis exceeds this many texels, the pixel gets the texture's mean: the coarsest level's texel.
pub const MAX_MAJOR_TEXELS: f64 = 1_048_576.0;

impl FootprintSettings {
    /// The reconstruction term at a level, in squared texels of the level. `minor_squared` is the squared minor
    /// semi-axis without the term, in the same unit. With the term it is at least k at every level, and it is a
    /// continuous function of the footprint. The term is at most k.
    pub fn k_at(&self, level: u32, minor_squared: f64) -> f64 {
        let k = f64::from(self.k);
        match self.k_texels {
            KTexels::OfLevel => k,
            KTexels::OfLevel0 => (k * 0.25f64.powi(level as i32)).max(k - minor_squared),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::paper::texture_mapping::footprint::KTexels;
    use crate::paper::texture_mapping::method::EllipseFilter;

    #[test]
    fn with_the_reconstruction_term_the_minor_axis_is_at_least_k_and_changes_no_faster_than_the_footprint() {
        for k in [0.0, 0.1, 0.5, 0.8, 4.0] {
            let footprint = EllipseFilter::BEST.k(k).footprint;
            let k = f64::from(k);
            for level in 0..20 {
                let mut last = footprint.k_at(level, 0.0);
                assert_eq!(last, k, "a footprint without area");
                for n in 1..1000 {
                    let minor = 0.01 * f64::from(n);
                    let term = footprint.k_at(level, minor);
                    assert!(
                        (0.0..=k).contains(&term) && minor + term >= k - 1e-12,
                        "{level}, {minor}: {term}"
                    );
                    assert!(
                        (0.0..=0.01 + 1e-12).contains(&(last - term)),
                        "{level}, {minor}: {last} to {term}"
                    );
                    last = term;
                }
                assert_eq!(
                    last,
                    if level == 0 { k } else { k / 4f64.powi(level as i32) },
                    "a large footprint"
                );
            }
            let of_level = EllipseFilter::BEST.k_texels(KTexels::OfLevel).k(k as f32).footprint;
            assert_eq!(of_level.k_at(3, 5.0), k);
        }
    }
}
