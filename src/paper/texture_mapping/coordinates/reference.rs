//! Coordinates and the differences of formula (9) in f64, from their definitions. [`TiltedPlane::jacobian`] computes
//! the exact derivatives.

use super::{DerivativeMethod, TiltedPlane};

/// (u, v) in texels at a position in pixels.
pub fn coordinates(plane: &TiltedPlane, x: f64, y: f64) -> [f64; 2] {
    let [u, v, w] = plane.0.map(|[by_x, by_y, constant]| by_x * x + by_y * y + constant);
    [u / w, v / w]
}

/// `[[du/dx, du/dy], [dv/dx, dv/dy]]` by formula (9): the difference to the right and the lower neighbour.
pub fn differences(plane: &TiltedPlane, x: f64, y: f64) -> [[f64; 2]; 2] {
    let [here, right, below] = [[x, y], [x + 1.0, y], [x, y + 1.0]].map(|[x, y]| coordinates(plane, x, y));
    [0, 1].map(|axis| [right[axis] - here[axis], below[axis] - here[axis]])
}

/// What a method should compute, in the order of the shaders: du/dx, dv/dx, du/dy, dv/dy.
pub fn derivatives(method: DerivativeMethod, plane: &TiltedPlane, x: f64, y: f64) -> [f64; 4] {
    let [[u_x, u_y], [v_x, v_y]] = match method {
        DerivativeMethod::Analytic => plane.jacobian(x, y),
        _ => differences(plane, x, y),
    };
    [u_x, v_x, u_y, v_y]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Formulas (7) to (9) with the row's constants, compared with the definitions.
    #[test]
    fn the_rows_constants_give_coordinates_and_both_derivatives() {
        for seed in 0..20 {
            let plane = TiltedPlane::random(seed, [1920, 1080], 8192.0);
            for (column, row) in [(0u32, 0u32), (7, 1000), (1919, 3), (960, 540)] {
                let (x, y, n) = (f64::from(column) + 0.5, f64::from(row) + 0.5, f64::from(column));
                let constants = plane.row_constants(row);
                let term = |c: usize| constants.start[c] + n * constants.step[c];
                let w = term(2);
                let [below_x, below_y] = [constants.step[2], constants.step_y].map(|step| w * (w + step));
                let (analytic, differences) = (plane.jacobian(x, y), differences(&plane, x, y));
                for axis in 0..2 {
                    let dy = constants.dy[axis] + n * constants.dy_step[axis];
                    let dx = constants.dx[axis];
                    let largest = analytic.iter().flatten().fold(0.0, |max: f64, d| max.max(d.abs()));
                    // A difference of two coordinates of 8192 texels has an error of 8192 * 2^-52.
                    let near = |found: f64, wanted: f64| (found - wanted).abs() < 1e-9 * largest + 1e-11;
                    assert!((term(axis) / w - coordinates(&plane, x, y)[axis]).abs() < 1e-9);
                    assert!(near(dx / (w * w), analytic[axis][0]) && near(dy / (w * w), analytic[axis][1]));
                    assert!(near(dx / below_x, differences[axis][0]), "{dx} {below_x} {differences:?}");
                    assert!(near(dy / below_y, differences[axis][1]), "{dy} {below_y} {differences:?}");
                    // As printed in the scanned paper: the numerator of d/dy over the denominator of d/dx.
                    let printed = dy / below_x;
                    assert!(!near(printed, differences[axis][1]) || (below_x - below_y).abs() < 1e-7);
                }
            }
        }
    }

    #[test]
    fn the_jacobians_determinant_is_that_of_the_homography_over_w_cubed() {
        let plane = TiltedPlane::random(3, [1920, 1080], 8192.0);
        let [[a, b, c], [d, e, f], [g, h, i]] = plane.0;
        let determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
        let (x, y) = (100.5, 900.5);
        let [[u_x, u_y], [v_x, v_y]] = plane.jacobian(x, y);
        let w = g * x + h * y + i;
        let (found, wanted) = (u_x * v_y - u_y * v_x, determinant / (w * w * w));
        assert!((found - wanted).abs() < 1e-9 * wanted.abs(), "{found} {wanted}");
    }
}
