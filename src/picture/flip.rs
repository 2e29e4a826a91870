//! FLIP: the visible difference of each pixel when a viewer alternates between two pictures, from 0 (none) to 1 (most).
//! Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020; NVIDIA's own code, through the
//! crate `nv-flip`.
//!
//! FLIP is defined on 8-bit sRGB, so linear light is encoded first and clamped to 0 ..= 1. FLIP misses differences
//! between values brighter than white, and differences smaller than half a code; the measures of [`super::error`]
//! include them.

use super::error::DifferentSizes;
use super::{Picture, srgb};

/// Pixels per degree of visual angle; the paper's viewer sits 0.7 m from a 0.7 m wide display of 3840 pixels.
pub const PIXELS_PER_DEGREE: f32 = nv_flip::DEFAULT_PIXELS_PER_DEGREE;

/// FLIP of each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Row by row, 0 ..= 1.
    pub values: Vec<f32>,
}

/// FLIP of `picture` against `truth`. A pixel that is not finite on either side counts as 1.
///
/// # Errors
/// [`DifferentSizes`].
pub fn flip(picture: &Picture, truth: &Picture) -> Result<FlipMap, DifferentSizes> {
    let (width, height) = (truth.width, truth.height);
    if (picture.width, picture.height) != (width, height) {
        return Err(DifferentSizes(picture.width, picture.height, width, height));
    }
    let image = |picture: &Picture| {
        let codes = |pixel: &[f32; 4]| [0, 1, 2].map(|c| srgb::from_linear_f64(f64::from(pixel[c])));
        let bytes: Vec<u8> = picture.rgba.iter().flat_map(codes).collect();
        nv_flip::FlipImageRgb8::with_data(width, height, &bytes)
    };
    let mut values = nv_flip::flip(image(truth), image(picture), PIXELS_PER_DEGREE).to_vec();
    for (value, (pixel, true_pixel)) in values.iter_mut().zip(picture.rgba.iter().zip(&truth.rgba)) {
        // Encoding turns a NaN into black, which would hide it.
        if !pixel.iter().chain(true_pixel).all(|channel| channel.is_finite()) {
            *value = 1.0;
        }
    }
    Ok(FlipMap { values })
}

impl FlipMap {
    /// Mean of all pixels; 0 for an empty picture.
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|&value| f64::from(value)).sum::<f64>() / self.values.len().max(1) as f64
    }

    /// Largest value.
    pub fn max(&self) -> f64 {
        self.values.iter().copied().fold(0.0, f32::max).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey() -> Picture {
        Picture::filled(24, 16, [0.2, 0.2, 0.2, 1.0])
    }

    #[test]
    fn equal_pictures_have_a_flip_of_zero() {
        let map = flip(&grey(), &grey()).unwrap();
        assert_eq!((map.values.len(), map.mean(), map.max()), (24 * 16, 0.0, 0.0));
        let one = Picture::filled(1, 1, [0.5; 4]);
        assert_eq!(flip(&one, &one).unwrap().values, [0.0]);
    }

    #[test]
    fn a_changed_pixel_is_found_at_its_place_and_a_stronger_change_counts_more() {
        let changed = |value: f32| {
            let mut picture = grey();
            picture.rgba[5 * 24 + 7] = [value, value, value, 1.0];
            flip(&picture, &grey()).unwrap()
        };
        let (weak, strong) = (changed(0.25), changed(1.0));
        assert_eq!(strong.max(), f64::from(strong.values[5 * 24 + 7]));
        assert!(0.0 < weak.mean() && weak.mean() < strong.mean(), "{} {}", weak.mean(), strong.mean());
        assert!(strong.values.iter().all(|value| (0.0..=1.0).contains(value)));
    }

    #[test]
    fn black_against_white_is_nearly_one() {
        let [black, white] = [0.0, 1.0].map(|c| Picture::filled(24, 16, [c, c, c, 1.0]));
        let map = flip(&black, &white).unwrap();
        assert!(map.mean() > 0.9 && map.max() <= 1.0, "{}", map.mean());
    }

    #[test]
    fn a_value_that_is_not_finite_counts_although_it_encodes_as_black() {
        let mut broken = Picture::filled(8, 8, [0.0, 0.0, 0.0, 1.0]);
        let truth = broken.clone();
        broken.rgba[9][1] = f32::NAN;
        let map = flip(&broken, &truth).unwrap();
        assert_eq!((map.values[9], map.values[10]), (1.0, 0.0));
        assert_eq!(flip(&grey(), &truth), Err(DifferentSizes(24, 16, 8, 8)));
    }
}
