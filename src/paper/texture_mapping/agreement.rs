//! Compares a method's picture on the GPU with the f64 reference, pixel by pixel.
//!
//! Coordinates and Jacobians are compared with the plane's in f64. The reference filter then takes the GPU's
//! coordinates and Jacobian as its input, so that the two results differ only by the filter's own rounding.

use crate::paper::texture_mapping::method::{Method, PixelCentre};
use crate::paper::texture_mapping::object_space::reference::Mean;
use crate::paper::texture_mapping::pass::Dumped;
use crate::paper::texture_mapping::plane::TiltedPlane;
use crate::paper::texture_mapping::reference;
use crate::paper::texture_mapping::texels::GreyMipmap;

/// The result of a comparison.
#[derive(Clone, Debug, Default)]
pub struct Agreement {
    pub pixels: usize,
    /// The largest difference of a value.
    pub worst: f64,
    /// The largest difference of a value, coordinate or derivative, divided by its rounding bound.
    pub worst_share: f64,
    /// Differences that rounding does not explain: wrong levels, texel counts or values.
    pub unexplained: Vec<String>,
}

/// Compares a picture of `plane`. `dumped` has `size` pixels, row by row; `frame` seeds the random numbers.
pub fn compare(
    dumped: &[Dumped],
    method: &Method,
    plane: &TiltedPlane,
    size: [u32; 2],
    texels: &GreyMipmap,
    frame: u32,
) -> Agreement {
    assert_eq!(dumped.len(), (size[0] * size[1]) as usize, "pixels");
    let mut agreement = Agreement { pixels: dumped.len(), ..Agreement::default() };
    for (n, found) in dumped.iter().enumerate() {
        let (column, row) = (n as u32 % size[0], n as u32 / size[0]);
        let at = [column, row].map(|n| f64::from(n) + 0.5);
        let at = [0, 1].map(|n| at[n] - f64::from(size[n]) / 2.0);
        let place = format!("({column}, {row})");
        match (&found.pixel, plane.texels(at[0], at[1])) {
            (None, None) => {}
            (Some(pixel), Some(centre)) => {
                coordinates(&mut agreement, &place, pixel, plane, at, centre);
                value(&mut agreement, &place, found, pixel, method, texels, frame);
            }
            _ if near_horizon(plane, at) => {}
            (seen, _) => agreement.unexplained.push(format!("{place}: visible: {}", seen.is_some())),
        }
    }
    agreement
}

/// The sum of the absolute values of a linear form's terms.
fn terms(row: [f64; 3], [x, y]: [f64; 2]) -> f64 {
    (row[0] * x).abs() + (row[1] * y).abs() + row[2].abs()
}

fn denominator(plane: &TiltedPlane, [x, y]: [f64; 2]) -> f64 {
    let [g, h, i] = plane.0[2];
    g * x + h * y + i
}

/// True if rounding decides the sign of w.
fn near_horizon(plane: &TiltedPlane, at: [f64; 2]) -> bool {
    denominator(plane, at).abs() < 2f64.powi(-22) * terms(plane.0[2], at)
}

fn coordinates(
    agreement: &mut Agreement,
    place: &str,
    pixel: &PixelCentre,
    plane: &TiltedPlane,
    at: [f64; 2],
    centre: [f64; 2],
) {
    // A linear form rounds its coefficients, products and sums: 3 half ulps of its absolute terms. A division follows.
    let w = denominator(plane, at);
    let relative_w = 2f64.powi(-22) * terms(plane.0[2], at) / w;
    let jacobian = plane.jacobian(at[0], at[1]);
    for n in 0..2 {
        let bound =
            2f64.powi(-22) * terms(plane.0[n], at) / w + centre[n].abs() * (relative_w + 2f64.powi(-22));
        judge(agreement, place, "coordinate", (pixel.centre[n] - centre[n]).abs(), bound);
        for m in 0..2 {
            // Derivatives are (constant + slope t) / w^2.
            let [numerator, denominator] = [plane.0[n], plane.0[2]];
            let cross = |a: usize, b: usize| numerator[a] * denominator[b] - denominator[a] * numerator[b];
            let terms = cross(m, 2).abs() + (cross(m, 1 - m) * at[1 - m]).abs();
            let bound =
                2f64.powi(-21) * terms / (w * w) + jacobian[n][m].abs() * (2.0 * relative_w + 2f64.powi(-21));
            judge(agreement, place, "derivative", (pixel.jacobian[n][m] - jacobian[n][m]).abs(), bound);
        }
    }
}

fn value(
    agreement: &mut Agreement,
    place: &str,
    found: &Dumped,
    pixel: &PixelCentre,
    method: &Method,
    texels: &GreyMipmap,
    frame: u32,
) {
    let [low, high] = reference::levels(method, pixel, texels);
    if matches!(method, Method::Ellipse(_)) && !(low..=high).contains(&found.level) {
        agreement.unexplained.push(format!("{place}: level {}, not {low} to {high}", found.level));
        return;
    }
    let level = found.level.clamp(low, high);
    let Some(truth) = reference::filtered(method, pixel, texels, level, frame) else { return };
    // An empty footprint shows the nearest texel, and counts it.
    let fetched = truth.fetched.max(1);
    if found.fetched.abs_diff(fetched) > truth.undecided {
        let (count, open) = (found.fetched, truth.undecided);
        agreement.unexplained.push(format!("{place}: {count} texels, not {fetched} with {open} undecided"));
    }
    if found.empty != truth.empty && truth.undecided == 0 {
        agreement.unexplained.push(format!("{place}: empty is {}", found.empty));
    }
    let error = (f64::from(found.colour[0]) - truth.value).abs();
    agreement.worst = agreement.worst.max(error);
    judge(agreement, place, "value", error, truth.slack);
}

/// Records an error above its bound. NaN always counts as an error above the bound.
fn judge(agreement: &mut Agreement, place: &str, what: &str, error: f64, bound: f64) {
    if error > 0.0 {
        agreement.worst_share = agreement.worst_share.max(error / bound);
    }
    if error.is_nan() || error > bound {
        agreement.unexplained.push(format!("{place}: {what} off by {error:.3e}, bound {bound:.3e}"));
    }
}

/// Compares a picture of object-space texturing with the reference. Pixels that rounding leaves undecided are skipped;
/// their number is returned too.
pub fn compare_fragments(found: &[[f32; 4]], means: &[Mean]) -> (Agreement, usize) {
    assert_eq!(found.len(), means.len(), "pixels");
    let mut agreement = Agreement { pixels: found.len(), ..Agreement::default() };
    for (n, (found, mean)) in found.iter().zip(means).enumerate().filter(|(_, (_, mean))| !mean.undecided) {
        let error = (f64::from(found[0]) - mean.value).abs();
        agreement.worst = agreement.worst.max(error);
        judge(&mut agreement, &format!("pixel {n}"), "value", error, mean.slack);
    }
    (agreement, means.iter().filter(|mean| mean.undecided).count())
}

/// NMSE of grey values: the sum of squared errors, divided by the sum of squares of the truth. NaN if a value is NaN.
pub fn nmse(found: impl ExactSizeIterator<Item = f64>, truth: &[f64]) -> f64 {
    assert_eq!(found.len(), truth.len(), "values");
    let squares: f64 = found.zip(truth).map(|(found, truth)| (found - truth).powi(2)).sum();
    squares / truth.iter().map(|truth| truth * truth).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nmse_is_relative_to_the_squares_of_the_truth() {
        let of = |found: [f64; 2]| nmse(found.into_iter(), &[3.0, 4.0]);
        assert_eq!((of([3.0, 0.0]), of([3.0, 4.0])), (16.0 / 25.0, 0.0));
        assert!(of([3.0, f64::NAN]).is_nan());
    }
}
