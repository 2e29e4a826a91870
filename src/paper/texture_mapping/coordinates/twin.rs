//! Each form of the coordinates, computed on the CPU in f32 with the GPU's operations.
//!
//! Vulkan allows an `fma` to round once or twice and a division to err by 2.5 ulp, so results differ between devices.
//! The twins therefore return numerators and denominator, whose arithmetic is fixed except for [`Fma`].

use super::{RowConstants, RowWalk, TiltedPlane};

/// How a device rounds an `fma`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fma {
    /// Once, after the addition.
    Fused,
    /// After the multiplication, and after the addition.
    Twice,
}

impl Fma {
    fn of(self, a: f32, b: f32, c: f32) -> f32 {
        match self {
            Fma::Fused => a.mul_add(b, c),
            Fma::Twice => a * b + c,
        }
    }
}

/// [`super::Form::Textbook`]: (u w, v w, w) at a pixel.
pub fn textbook(plane: &TiltedPlane, column: u32, row: u32) -> [f32; 3] {
    let (x, y) = (column as f32 + 0.5, row as f32 + 0.5);
    plane.0.map(|row| {
        let [by_x, by_y, constant] = row.map(|c| c as f32);
        by_x * x + by_y * y + constant
    })
}

/// [`super::Form::TextbookBy`]: (u w, v w, w) at a pixel.
pub fn textbook_by(plane: &TiltedPlane, column: u32, row: u32, fma: Fma) -> [f32; 3] {
    let (x, y) = (column as f32 + 0.5, row as f32 + 0.5);
    plane.0.map(|row| {
        let [by_x, by_y, constant] = row.map(|c| c as f32);
        fma.of(by_x, x, by_y * y + constant)
    })
}

/// [`super::Form::RowConstants`] and [`super::Form::RowConstantsBy`].
pub fn row_constants(constants: &RowConstants, column: u32, fma: Fma) -> [f32; 3] {
    [0, 1, 2].map(|c| fma.of(constants.step[c] as f32, column as f32, constants.start[c] as f32))
}

/// [`super::Form::Walk`]: a whole row.
pub fn walk(constants: &RowConstants, walk: RowWalk, width: u32, fma: Fma) -> Vec<[f32; 3]> {
    let mut row = vec![[0.0; 3]; width as usize];
    for lane in 0..walk.lanes(width) {
        let (first, stride, count) = walk.columns(lane, width);
        let mut terms = row_constants(constants, first, fma);
        let step = constants.step.map(|step| step as f32 * stride as f32);
        for n in 0..count as i32 {
            row[(first as i32 + n * stride) as usize] = terms;
            terms = [0, 1, 2].map(|c| terms[c] + step[c]);
        }
    }
    row
}

/// The constants of an integer walk: start and step, scaled by the power of two that keeps the whole row
/// below 2^61.
pub fn integers(constants: &RowConstants, width: u32) -> [[i64; 3]; 2] {
    let end = |c: usize| constants.start[c] + f64::from(width) * constants.step[c];
    let largest = (0..3).fold(0.0, |max: f64, c| max.max(constants.start[c].abs()).max(end(c).abs()));
    let scale = (61.0 - largest.log2().ceil()).exp2();
    [constants.start, constants.step].map(|values| values.map(|value| (value * scale).round() as i64))
}

/// [`super::Form::Integer`]: (u w, v w, w) of a pixel, scaled by the set-up's power of two.
pub fn integer_terms([start, step]: [[i64; 3]; 2], column: u32) -> [i64; 3] {
    [0, 1, 2].map(|c| start[c] + step[c] * i64::from(column))
}

/// Largest error in u and v of a pixel, in texels, for a form that rounds its constants once and its `fma` up to
/// twice. Each rounded value adds half an ulp, 2^-24; the division adds 2.5 ulp, each at most 2^-23 of the quotient.
pub fn row_constants_error(constants: &RowConstants, column: u32) -> [f64; 2] {
    let n = f64::from(column);
    let rounded = |c: usize| {
        let (start, along) = (constants.start[c], n * constants.step[c]);
        // Roundings of the constants, the product and the sum.
        2f64.powi(-24) * (start.abs() + 2.0 * along.abs() + (start + along).abs())
    };
    let w = constants.start[2] + n * constants.step[2];
    [0, 1].map(|c| {
        let texels = ((constants.start[c] + n * constants.step[c]) / w).abs();
        (rounded(c) + texels * rounded(2)) / w.abs() + 2.5 * 2f64.powi(-23) * texels
    })
}
