//! Error measures of a picture against a reference picture ("truth"). A mean can hide a wrong tile, so also
//! check the worst pixel and the number of pixels above a bound.

use super::Picture;
use serde::Serialize;
use thiserror::Error;

/// Two pictures that cannot be compared.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("a picture of {0} x {1} pixels cannot be compared with one of {2} x {3}")]
pub struct DifferentSizes(pub u32, pub u32, pub u32, pub u32);

/// A pixel and its error: the largest absolute difference of a channel in linear light. [`compare`] includes alpha,
/// [`compare_colours`] does not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PixelError {
    pub x: u32,
    pub y: u32,
    pub value: f64,
}

/// The result of [`compare`].
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Row by row.
    errors: Vec<PixelError>,
    /// Sum over red, green and blue.
    squared_error: f64,
    squared_truth: f64,
}

/// Compares every channel of every pixel. A non-finite value on either side is an infinite error, even if
/// both sides have it.
///
/// # Errors
/// [`DifferentSizes`].
pub fn compare(picture: &Picture, truth: &Picture) -> Result<Difference, DifferentSizes> {
    compare_where(picture, truth, |_, _| true)
}

/// Like [`compare`], but ignores alpha.
///
/// # Errors
/// [`DifferentSizes`].
pub fn compare_colours(picture: &Picture, truth: &Picture) -> Result<Difference, DifferentSizes> {
    differences(picture, truth, 3, |_, _| true)
}

/// Like [`compare`], restricted to pixels for which `counts` (column, row) is true.
///
/// # Errors
/// [`DifferentSizes`].
pub fn compare_where(
    picture: &Picture,
    truth: &Picture,
    counts: impl Fn(u32, u32) -> bool,
) -> Result<Difference, DifferentSizes> {
    differences(picture, truth, 4, counts)
}

/// Compares the first `channels` channels.
fn differences(
    picture: &Picture,
    truth: &Picture,
    channels: usize,
    counts: impl Fn(u32, u32) -> bool,
) -> Result<Difference, DifferentSizes> {
    if (picture.width, picture.height) != (truth.width, truth.height) {
        return Err(DifferentSizes(picture.width, picture.height, truth.width, truth.height));
    }
    let mut found = Difference { errors: Vec::new(), squared_error: 0.0, squared_truth: 0.0 };
    for (index, (pixel, true_pixel)) in picture.rgba.iter().zip(&truth.rgba).enumerate() {
        let (x, y) = (index as u32 % truth.width, index as u32 / truth.width);
        if !counts(x, y) {
            continue;
        }
        let mut largest: f64 = 0.0;
        for (channel, (&value, &true_value)) in pixel.iter().zip(true_pixel).take(channels).enumerate() {
            let (value, true_value) = (f64::from(value), f64::from(true_value));
            let finite = value.is_finite() && true_value.is_finite();
            let error = if finite { (value - true_value).abs() } else { f64::INFINITY };
            largest = largest.max(error);
            // Colour only: an alpha of 1 everywhere would lower every NMSE.
            if channel < 3 {
                found.squared_error += error * error;
                found.squared_truth += if finite { true_value * true_value } else { 0.0 };
            }
        }
        found.errors.push(PixelError { x, y, value: largest });
    }
    Ok(found)
}

impl Difference {
    /// Sum of squared errors divided by the sum of the truth's squares, over red, green and blue. Infinite if
    /// the truth is black and the picture is not.
    pub fn nmse(&self) -> f64 {
        // Avoids 0 / 0 if both are black.
        if self.squared_error == 0.0 { 0.0 } else { self.squared_error / self.squared_truth }
    }

    /// Peak signal-to-noise ratio in dB, `10 log10(1 / MSE)`: MSE is the mean squared error of red, green and
    /// blue in linear light; the peak is 1. Infinite for equal pictures, minus infinity if a value is not
    /// finite.
    pub fn psnr_db(&self) -> f64 {
        if self.squared_error == 0.0 {
            return f64::INFINITY;
        }
        -10.0 * (self.squared_error / (3.0 * self.errors.len() as f64)).log10()
    }

    /// The largest error and the first pixel, row by row, that has it. `None` for an empty picture.
    pub fn worst(&self) -> Option<PixelError> {
        let mut worst: Option<PixelError> = None;
        for error in self.pixels() {
            if worst.is_none_or(|worst| error.value > worst.value) {
                worst = Some(error);
            }
        }
        worst
    }

    /// The largest error; 0 for an empty picture.
    pub fn largest(&self) -> f64 {
        self.worst().map_or(0.0, |pixel| pixel.value)
    }

    /// Number of pixels with an error above `bound`.
    pub fn count_above(&self, bound: f64) -> usize {
        self.errors.iter().filter(|error| error.value > bound).count()
    }

    /// Every pixel's error, row by row.
    pub fn pixels(&self) -> impl ExactSizeIterator<Item = PixelError> + '_ {
        self.errors.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey() -> Picture {
        Picture::filled(4, 3, [0.5, 0.5, 0.5, 1.0])
    }

    fn changed(x: u32, y: u32, channel: usize, value: f32) -> Picture {
        let mut picture = grey();
        picture.rgba[(y * 4 + x) as usize][channel] = value;
        picture
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let difference = compare(&grey(), &grey()).unwrap();
        assert_eq!((difference.nmse(), difference.count_above(0.0)), (0.0, 0));
        assert_eq!(difference.worst().unwrap().value, 0.0);
    }

    #[test]
    fn one_wrong_channel_of_one_pixel_is_found_at_its_place() {
        for channel in 0..4 {
            let difference = compare(&changed(2, 1, channel, 0.75), &grey()).unwrap();
            let worst = difference.worst().unwrap();
            assert_eq!((worst.x, worst.y, worst.value), (2, 1, 0.25));
            assert_eq!((difference.count_above(0.24), difference.count_above(0.25)), (1, 0));
        }
    }

    #[test]
    fn a_comparison_of_colours_ignores_alpha() {
        for (channel, error) in [(2, 0.25), (3, 0.0)] {
            let difference = compare_colours(&changed(2, 1, channel, 0.75), &grey()).unwrap();
            assert_eq!(difference.worst().unwrap().value, error);
        }
    }

    #[test]
    fn nmse_is_the_squared_error_over_the_squared_truth() {
        // 12 pixels of 3 x 0.25 add up to 9; one channel is off by 0.25; alpha is ignored.
        let difference = compare(&changed(0, 0, 1, 0.75), &grey()).unwrap();
        assert_eq!(difference.nmse(), 0.0625 / 9.0);
        let black = Picture::filled(4, 3, [0.0; 4]);
        assert_eq!(compare(&black, &black).unwrap().nmse(), 0.0);
        assert_eq!(compare(&grey(), &black).unwrap().nmse(), f64::INFINITY);
    }

    #[test]
    fn psnr_is_of_the_mean_squared_error_against_a_peak_of_one() {
        // All of 36 values off by 0.1: an MSE of 0.01.
        let darker = Picture::filled(4, 3, [0.4, 0.4, 0.4, 1.0]);
        let psnr_db = compare(&darker, &grey()).unwrap().psnr_db();
        assert!((psnr_db - 20.0).abs() < 1e-5, "{psnr_db}");
        // One of 36 is off by 0.25: 10 log10(36 / 0.0625). Half the error would give 6.02 dB more.
        let psnr_db = compare(&changed(0, 0, 1, 0.75), &grey()).unwrap().psnr_db();
        assert!((psnr_db - 27.604).abs() < 1e-3, "{psnr_db}");
        assert_eq!(compare(&grey(), &grey()).unwrap().psnr_db(), f64::INFINITY);
        let broken = changed(0, 0, 0, f32::NAN);
        assert_eq!(compare(&broken, &grey()).unwrap().psnr_db(), f64::NEG_INFINITY);
    }

    #[test]
    fn excluded_pixels_change_nothing_and_included_ones_count() {
        let picture = changed(2, 1, 0, 0.75);
        let elsewhere = compare_where(&picture, &grey(), |x, y| (x, y) != (2, 1)).unwrap();
        assert_eq!((elsewhere.nmse(), elsewhere.pixels().len(), elsewhere.count_above(0.0)), (0.0, 11, 0));
        let there = compare_where(&picture, &grey(), |x, y| (x, y) == (2, 1)).unwrap();
        assert_eq!(there.worst(), Some(PixelError { x: 2, y: 1, value: 0.25 }));
        assert_eq!(there.nmse(), 0.0625 / 0.75);
        assert_eq!(compare_where(&picture, &grey(), |_, _| false).unwrap().worst(), None);
    }

    #[test]
    fn a_value_that_is_not_finite_is_an_infinite_error_even_against_itself() {
        for value in [f32::NAN, f32::INFINITY] {
            let broken = changed(3, 2, 0, value);
            for truth in [grey(), broken.clone()] {
                let difference = compare(&broken, &truth).unwrap();
                assert_eq!(difference.worst().unwrap(), PixelError { x: 3, y: 2, value: f64::INFINITY });
                assert_eq!(difference.nmse(), f64::INFINITY);
                assert_eq!(difference.count_above(1e300), 1);
            }
            assert_eq!(compare(&grey(), &broken).unwrap().count_above(1e300), 1);
        }
    }

    #[test]
    fn a_shift_by_one_pixel_is_rejected() {
        let mut picture = changed(1, 1, 0, 0.0);
        let truth = picture.clone();
        picture.rgba.rotate_right(1);
        let difference = compare(&picture, &truth).unwrap();
        assert_eq!((difference.count_above(0.1), difference.worst().unwrap().value), (2, 0.5));
    }

    #[test]
    fn pictures_of_different_shape_are_not_compared() {
        let turned = Picture::filled(3, 4, [0.5; 4]);
        assert_eq!(compare(&grey(), &turned), Err(DifferentSizes(4, 3, 3, 4)));
    }
}
