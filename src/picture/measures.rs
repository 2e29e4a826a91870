//! All measures of a picture against a truth; printed by `ortelius compare` and reported by figures.

use super::Picture;
use super::error::{Difference, DifferentSizes, PixelError, compare_colours};
use super::flip::{FlipMap, flip};
use serde::Serialize;

/// Default bound for outliers: 5/256 of linear light. A trilinear sample with 8-bit weights is off by at most 3/256
/// ([`SAMPLER_ERROR`](crate::reference::filter::SAMPLER_ERROR)); the rest allows for the position of the sample.
pub const OUTLIER_BOUND: f64 = 5.0 / 256.0;

/// Numbers of one comparison. In JSON, infinity is null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measures {
    pub pixels: usize,
    pub nmse: f64,
    pub psnr_db: f64,
    /// Mean of FLIP, 0 ..= 1.
    pub flip_mean: f64,
    pub flip_worst: f64,
    /// `None` for an empty picture.
    pub worst: Option<PixelError>,
    pub outlier_bound: f64,
    /// Number of pixels whose error exceeds `outlier_bound`.
    pub outliers: usize,
    /// Number of pixels with a NaN or an infinity on either side; they also count as outliers.
    pub not_finite: usize,
}

/// A comparison with every pixel's error. Alpha is ignored, except that FLIP is 1 where alpha is not finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    pub difference: Difference,
    pub flip: FlipMap,
    /// Absolute differences of red, green and blue, row by row.
    pub absolute: Vec<[f32; 3]>,
}

impl Comparison {
    /// # Errors
    /// [`DifferentSizes`].
    pub fn of(picture: &Picture, truth: &Picture) -> Result<Comparison, DifferentSizes> {
        let (difference, flip) = (compare_colours(picture, truth)?, flip(picture, truth)?);
        let absolute = |(a, b): (&[f32; 4], &[f32; 4])| [0, 1, 2].map(|c| (a[c] - b[c]).abs());
        let absolute = picture.rgba.iter().zip(&truth.rgba).map(absolute).collect();
        Ok(Comparison { difference, flip, absolute })
    }

    pub fn measures(&self, outlier_bound: f64) -> Measures {
        let Comparison { difference, flip, .. } = self;
        Measures {
            pixels: difference.pixels().len(),
            nmse: difference.nmse(),
            psnr_db: difference.psnr_db(),
            flip_mean: flip.mean(),
            flip_worst: flip.max(),
            worst: difference.worst(),
            outlier_bound,
            outliers: difference.count_above(outlier_bound),
            not_finite: difference.pixels().filter(|error| error.value.is_infinite()).count(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_measure_is_of_the_same_two_pictures() {
        let truth = Picture::filled(4, 2, [0.5, 0.5, 0.5, 1.0]);
        let mut picture = truth.clone();
        picture.rgba[6][2] = 0.25;
        picture.rgba[1][0] = f32::INFINITY;
        let comparison = Comparison::of(&picture, &truth).unwrap();
        let found = comparison.measures(0.3);
        assert_eq!((found.pixels, found.outliers, found.not_finite), (8, 1, 1));
        assert_eq!(found.worst, Some(PixelError { x: 1, y: 0, value: f64::INFINITY }));
        assert_eq!((found.nmse, found.psnr_db, found.flip_worst), (f64::INFINITY, f64::NEG_INFINITY, 1.0));
        assert_eq!(comparison.measures(0.2).outliers, 2);
        picture.rgba[1][0] = 0.5;
        let found = Comparison::of(&picture, &truth).unwrap().measures(0.2);
        assert_eq!((found.outliers, found.not_finite), (1, 0));
        // The squares of 24 values of 0.5 add up to 6. One value is off by 0.25.
        assert_eq!(found.nmse, 0.0625 / 6.0);
        assert!(0.0 < found.flip_mean && found.flip_mean < 1.0);
    }
}
