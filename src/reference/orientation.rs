//! The side of an edge on which a point lies, without rounding: the sign of a 3x3 determinant of doubles.
//!
//! Rounded edge functions agree along a shared edge, because the two triangles compute opposite numbers. They do not
//! agree at a vertex: a pixel centre exactly at a vertex could fall between all triangles around it. The exact sum
//! follows Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997
//! (two-sum, grow-expansion). Products of three values must stay within the range of f64.

use glam::DVec3;

/// Sign (-1, 0, 1) of `(a x b) . p`, exactly.
pub fn orientation(a: DVec3, b: DVec3, p: DVec3) -> f64 {
    let rounded = a.cross(b).dot(p);
    // Each of the six products is rounded at most five times, so the error is at most 5 x 2^-53 of the sum of
    // magnitudes. That sum is rounded too, which adds a little; a factor of 8 is enough.
    let (a_abs, b_abs) = (a.abs(), b.abs());
    let magnitude = DVec3::new(
        a_abs.y * b_abs.z + b_abs.y * a_abs.z,
        a_abs.z * b_abs.x + b_abs.z * a_abs.x,
        a_abs.x * b_abs.y + b_abs.x * a_abs.y,
    )
    .dot(p.abs());
    if rounded.abs() > 8.0 * (f64::EPSILON / 2.0) * magnitude {
        return rounded.signum();
    }
    let mut sum = ExactSum::default();
    for (i, j, k) in [(1, 2, 0), (2, 0, 1), (0, 1, 2)] {
        sum.add_product(a[i], b[j], p[k]);
        sum.add_product(-a[j], b[i], p[k]);
    }
    sum.sign()
}

/// Like [`orientation`], for a point shifted by (e, e^2, 0) with infinitesimal e, so that a point on an edge lies on
/// exactly one side. The result is 0 only if the x and y components of `a x b` are both 0.
pub fn orientation_without_ties(a: DVec3, b: DVec3, p: DVec3) -> f64 {
    let signs = [p, DVec3::X, DVec3::Y].map(|direction| orientation(a, b, direction));
    signs.into_iter().find(|&sign| sign != 0.0).unwrap_or(0.0)
}

/// An exact sum of doubles: non-overlapping parts, from smallest to largest.
#[derive(Default)]
struct ExactSum {
    parts: Vec<f64>,
}

impl ExactSum {
    fn add(&mut self, value: f64) {
        let mut carried = value;
        let mut parts = Vec::with_capacity(self.parts.len() + 1);
        for &part in &self.parts {
            let (sum, rest) = two_sum(carried, part);
            if rest != 0.0 {
                parts.push(rest);
            }
            carried = sum;
        }
        if carried != 0.0 {
            parts.push(carried);
        }
        self.parts = parts;
    }

    fn add_product(&mut self, x: f64, y: f64, z: f64) {
        let (high, low) = two_product(x, y);
        for part in [high, low] {
            let (high, low) = two_product(part, z);
            self.add(low);
            self.add(high);
        }
    }

    fn sign(&self) -> f64 {
        // The largest part outweighs all others together.
        self.parts.last().map_or(0.0, |largest| largest.signum())
    }
}

/// x + y as a double plus the rounding error (Knuth).
fn two_sum(x: f64, y: f64) -> (f64, f64) {
    let sum = x + y;
    let y_part = sum - x;
    (sum, (x - (sum - y_part)) + (y - y_part))
}

/// x y as a double plus the rounding error.
fn two_product(x: f64, y: f64) -> (f64, f64) {
    let product = x * y;
    (product, x.mul_add(y, -product))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sign_is_that_of_the_right_handed_triple() {
        assert_eq!(orientation(DVec3::X, DVec3::Y, DVec3::Z), 1.0);
        assert_eq!(orientation(DVec3::Y, DVec3::X, DVec3::Z), -1.0);
        assert_eq!(orientation(DVec3::X, DVec3::Y, DVec3::new(3.0, 4.0, 0.0)), 0.0);
    }

    #[test]
    fn the_last_bit_decides_where_rounding_would_lose_it() {
        let (a, b) = (DVec3::new(0.1, 0.7, 1.3), DVec3::new(0.3, 2.1, 3.9));
        // b is 3 a up to rounding: a x b consists of rounding errors only, and still has a definite sign.
        let tiny = DVec3::new(1.0, 1.0, 1.0);
        assert_eq!(orientation(a, b, tiny), -orientation(b, a, tiny));
        let on = a * 4.0;
        assert_eq!(orientation(a, b, on), 0.0);
        let off = DVec3::new(on.x, on.y, f64::from_bits(on.z.to_bits() + 1));
        // The sign of (a x b) . z is that of 0.1 x 2.1 - 0.7 x 0.3, with the double nearest to each decimal.
        let mut cross_z = ExactSum::default();
        cross_z.add_product(0.1, 2.1, 1.0);
        cross_z.add_product(-0.7, 0.3, 1.0);
        assert_ne!(cross_z.sign(), 0.0);
        assert_eq!(orientation(a, b, off), cross_z.sign());
    }

    #[test]
    fn an_exact_sum_keeps_digits_that_doubles_lose() {
        let mut sum = ExactSum::default();
        for value in [1e300, 1.0, -1e300, -1.0, 1e-300] {
            sum.add(value);
        }
        assert_eq!(sum.parts, [1e-300]);
    }

    #[test]
    fn a_point_on_an_edge_lies_on_one_side_only() {
        let (a, b) = (DVec3::new(0.0, 0.0, 1.0), DVec3::new(2.0, 2.0, 1.0));
        let on = DVec3::new(1.0, 1.0, 1.0);
        assert_eq!(orientation(a, b, on), 0.0);
        let side = orientation_without_ties(a, b, on);
        assert_eq!((side.abs(), orientation_without_ties(b, a, on)), (1.0, -side));
    }
}
