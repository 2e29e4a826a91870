//! How far a picture is from the truth. A mean alone hides a wrong tile: look at the worst pixel and at
//! the number of pixels beyond a bound.

use super::Picture;
use thiserror::Error;

/// Two pictures that cannot be compared.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("a picture of {0} x {1} pixels cannot be compared with one of {2} x {3}")]
pub struct DifferentSizes(pub u32, pub u32, pub u32, pub u32);

/// A pixel and its error: the largest absolute difference of a channel in linear light (alpha counts).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelError {
    pub x: u32,
    pub y: u32,
    pub value: f64,
}

/// What [`compare`] found.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    width: u32,
    /// Row by row, as [`PixelError::value`].
    errors: Vec<f64>,
    nmse: f64,
}

/// Compares every channel of every pixel. A value that is not finite, on either side, is an infinite error,
/// also where both have it: neither is a colour.
///
/// # Errors
/// [`DifferentSizes`].
pub fn compare(picture: &Picture, truth: &Picture) -> Result<Difference, DifferentSizes> {
    if (picture.width, picture.height) != (truth.width, truth.height) {
        return Err(DifferentSizes(picture.width, picture.height, truth.width, truth.height));
    }
    let (mut squared_error, mut squared_truth) = (0.0, 0.0);
    let mut errors = Vec::with_capacity(truth.rgba.len());
    for (pixel, true_pixel) in picture.rgba.iter().zip(&truth.rgba) {
        let mut largest: f64 = 0.0;
        for (channel, (&value, &true_value)) in pixel.iter().zip(true_pixel).enumerate() {
            let (value, true_value) = (f64::from(value), f64::from(true_value));
            let finite = value.is_finite() && true_value.is_finite();
            let error = if finite { (value - true_value).abs() } else { f64::INFINITY };
            largest = largest.max(error);
            // Colour alone: an alpha of 1 everywhere would only make every NMSE look smaller.
            if channel < 3 {
                squared_error += error * error;
                squared_truth += if finite { true_value * true_value } else { 0.0 };
            }
        }
        errors.push(largest);
    }
    // 0 / 0: black that is black.
    let nmse = if squared_error == 0.0 { 0.0 } else { squared_error / squared_truth };
    Ok(Difference { width: truth.width, errors, nmse })
}

impl Difference {
    /// Sum of squared errors over sum of the truth's squares, over red, green and blue; infinite where the truth is
    /// black and the picture is not.
    pub fn nmse(&self) -> f64 {
        self.nmse
    }

    /// The largest error and the first place, row by row, that has it. `None` for a picture of no pixels.
    pub fn worst(&self) -> Option<PixelError> {
        let mut worst: Option<PixelError> = None;
        for error in self.pixels() {
            if worst.is_none_or(|worst| error.value > worst.value) {
                worst = Some(error);
            }
        }
        worst
    }

    /// How many pixels have an error above `bound`.
    pub fn count_above(&self, bound: f64) -> usize {
        self.errors.iter().filter(|&&error| error > bound).count()
    }

    /// Every pixel's error, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = PixelError> + '_ {
        self.errors.iter().enumerate().map(|(index, &value)| {
            let (row, column) = (index / self.width as usize, index % self.width as usize);
            PixelError { x: column as u32, y: row as u32, value }
        })
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
    fn nmse_is_the_squared_error_over_the_squared_truth() {
        // 12 pixels of 3 x 0.25 are 9; one channel is off by 0.25, and alpha counts for nothing.
        let difference = compare(&changed(0, 0, 1, 0.75), &grey()).unwrap();
        assert_eq!(difference.nmse(), 0.0625 / 9.0);
        let black = Picture::filled(4, 3, [0.0; 4]);
        assert_eq!(compare(&black, &black).unwrap().nmse(), 0.0);
        assert_eq!(compare(&grey(), &black).unwrap().nmse(), f64::INFINITY);
    }

    #[test]
    fn what_is_not_finite_is_an_infinite_error_even_against_itself() {
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
