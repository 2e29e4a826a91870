//! Distances to a triangle: exact ones, and lower and upper bounds at a third of the cost. Two of three distances on a
//! dragon are only compared with another distance.

use super::lost::squared_to_segment;
use glam::DVec3;

/// Squared sine of the angle at the first corner, below which barycentric coordinates are too inexact for a
/// bound. Cancellation grows with the reciprocal of this square, so an error of 1e-12 of a side remains.
const MIN_SINE_SQUARED: f64 = 1e-4;

/// Squared ratio of the sides at the first corner, below which barycentric coordinates are also too inexact: the
/// shorter side's coordinate loses digits in proportion to the ratio. The exact formula loses them too, and a bound
/// must not cross its result.
const MIN_SIDES_SQUARED: f64 = 1e-4;

/// Rounding error of a bound's barycentric coordinates: 50 times the error that [`MIN_SINE_SQUARED`] allows.
const SLACK: f64 = 1e-10;

/// Factor by which a bound is widened, so that rounding never makes it cross the exact formula's result.
const WIDER: f64 = 1.0 + 1e-6;

/// Rounding error of a squared distance, relative to a side's squared length. With r = 64 roundings and
/// m = [`WIDER`] - 1, the mixed term 2 d r is at most m d^2 + r^2 / m. So this is r^2 / m.
const ROUNDING: f64 = 2e-22;

/// A triangle, possibly degenerate to a segment or a point, with the terms shared by all distances to it.
#[derive(Clone, Copy, Debug)]
pub struct DistanceTriangle {
    corners: [DVec3; 3],
    ab: DVec3,
    ac: DVec3,
    ab_squared: f64,
    ac_squared: f64,
    ab_dot_ac: f64,
    /// Squared length of the cross product of `ab` and `ac`.
    cross_squared: f64,
    /// 1 / `cross_squared`; 0 for a thin triangle or a needle.
    inverse: f64,
    /// Upper bound of the rounding error of squared distances.
    rounding: f64,
}

impl DistanceTriangle {
    pub fn new([a, b, c]: [DVec3; 3]) -> DistanceTriangle {
        DistanceTriangle::with_cross([a, b, c], (b - a).cross(c - a))
    }

    /// As [`DistanceTriangle::new`], with the cross product of the sides at the first corner already known.
    pub fn with_cross([a, b, c]: [DVec3; 3], cross: DVec3) -> DistanceTriangle {
        let (ab, ac) = (b - a, c - a);
        let (ab_squared, ac_squared) = (ab.length_squared(), ac.length_squared());
        let cross_squared = cross.length_squared();
        let thin = MIN_SINE_SQUARED * ab_squared * ac_squared + f64::MIN_POSITIVE;
        let is_needle = min(ab_squared, ac_squared) < MIN_SIDES_SQUARED * max(ab_squared, ac_squared);
        DistanceTriangle {
            corners: [a, b, c],
            ab,
            ac,
            ab_squared,
            ac_squared,
            ab_dot_ac: ab.dot(ac),
            cross_squared,
            inverse: if cross_squared > thin && !is_needle { 1.0 / cross_squared } else { 0.0 },
            rounding: ROUNDING * (ab_squared + ac_squared),
        }
    }

    pub fn corners(&self) -> [DVec3; 3] {
        self.corners
    }

    /// The coordinates of a point's projection along `ab` and `ac`; 0 for a thin triangle.
    fn barycentric(&self, ap: DVec3) -> (f64, f64) {
        let (d1, d2) = (self.ab.dot(ap), self.ac.dot(ap));
        let v = (self.ac_squared * d1 - self.ab_dot_ac * d2) * self.inverse;
        let w = (self.ab_squared * d2 - self.ab_dot_ac * d1) * self.inverse;
        (v, w)
    }

    /// Clamped barycentric coordinates of `p`: the corners' weights at a point that is near the triangle's nearest
    /// point to `p`. A thin triangle has the weights of its first corner.
    pub fn weights(&self, p: DVec3) -> [f64; 3] {
        let (v, w) = self.barycentric(p - self.corners[0]);
        let v = min(max(v, 0.0), 1.0);
        let w = min(max(w, 0.0), 1.0 - v);
        [1.0 - v - w, v, w]
    }

    /// An upper bound of the squared distance: that to some point of the triangle, found without a branch.
    pub fn at_most(&self, p: DVec3) -> f64 {
        let [_, v, w] = self.weights(p);
        (p - self.corners[0] - self.ab * v - self.ac * w).length_squared() * WIDER + self.rounding
    }

    /// True if [`Self::squared_to`] certainly exceeds `squared`, because the point lies beyond one of the sides by more
    /// than that distance.
    pub fn is_beyond(&self, p: DVec3, squared: f64) -> bool {
        let (v, w) = self.barycentric(p - self.corners[0]);
        let bc_squared = self.ab_squared + self.ac_squared - 2.0 * self.ab_dot_ac;
        let beyond = |coordinate: f64, side_squared: f64| {
            let depth = max(-coordinate - SLACK, 0.0);
            depth * depth * self.cross_squared > (squared * WIDER + self.rounding) * side_squared
        };
        beyond(v, self.ac_squared) | beyond(w, self.ab_squared) | beyond(1.0 - v - w, bc_squared)
    }

    /// The squared distance from a point (Ericson, "Real-Time Collision Detection", 5.1.5). The result is too large if
    /// the sine at the first corner, or the ratio of the sides there, is below 1e-7 but not 0. In this case
    /// cancellation removes all digits.
    pub fn squared_to(&self, p: DVec3) -> f64 {
        let DistanceTriangle { corners: [a, b, c], ab, ac, .. } = *self;
        let ap = p - a;
        let (d1, d2) = (ab.dot(ap), ac.dot(ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return ap.length_squared();
        }
        let bp = p - b;
        let (d3, d4) = (ab.dot(bp), ac.dot(bp));
        if d3 >= 0.0 && d4 <= d3 {
            return bp.length_squared();
        }
        let cp = p - c;
        let (d5, d6) = (ab.dot(cp), ac.dot(cp));
        if d6 >= 0.0 && d5 <= d6 {
            return cp.length_squared();
        }
        let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return squared_to_segment(p, [a, b]);
        }
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return squared_to_segment(p, [a, c]);
        }
        let sum = va + vb + vc;
        if (va <= 0.0 && d4 >= d3 && d5 >= d6) || sum <= 0.0 {
            return squared_to_segment(p, [b, c]);
        }
        (ap - ab * (vb / sum) - ac * (vc / sum)).length_squared()
    }
}

/// `f64::max` without NaN handling: one instruction.
fn max(x: f64, y: f64) -> f64 {
    if x > y { x } else { y }
}

fn min(x: f64, y: f64) -> f64 {
    if x < y { x } else { y }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers between -1 and 1 (a congruential generator's upper bits).
    fn numbers(mut state: u64) -> impl FnMut() -> f64 {
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    /// Triangles of many sizes and shapes: the second side approaches the first, or coincides with it.
    fn triangles() -> impl Iterator<Item = DistanceTriangle> {
        let mut number = numbers(1);
        (0..4000).map(move |index| {
            let mut point = || DVec3::new(number(), number(), number());
            let (a, ab, ac) = (point(), point(), point());
            let (thin, size) = (10.0_f64.powi(-(index % 20)), 10.0_f64.powi(-(index / 20 % 12)));
            let ac = match index % 7 {
                0 => DVec3::ZERO,
                1 => ab,
                2 => ab * -0.5,
                3 => ab + ac * thin,
                4 => (ab * number() + ac) * thin,
                _ => ab * number() + ac * thin,
            };
            DistanceTriangle::new([a, a + ab * size, a + ac * size])
        })
    }

    /// Points near and far, above the triangle, in its plane, and on it.
    fn points(triangle: &DistanceTriangle, seed: u64) -> impl Iterator<Item = DVec3> {
        let (mut number, [a, b, c]) = (numbers(seed), triangle.corners());
        let (normal, size) =
            ((b - a).cross(c - a).normalize_or_zero(), (b - a).length().max((c - a).length()));
        (0..60).map(move |index| {
            let reach = [1.0, 0.5, 3.0, 100.0][index % 4];
            let beside = (b - a) * (number() * reach) + (c - a) * (number() * reach);
            let off = [0.0, 1e-18, 1e-9, 1e-3, 1.0][index % 5] * size;
            match index % 3 {
                0 => a + DVec3::new(number(), number(), number()) * (size * reach),
                1 => [a, b, c][index % 9 / 3] + normal * off,
                _ => a + beside + normal * off,
            }
        })
    }

    /// True if the exact formula loses at most half of its digits.
    fn is_exact(triangle: &DistanceTriangle) -> bool {
        triangle.cross_squared == 0.0
            || (triangle.cross_squared > 1e-8 * triangle.ab_squared * triangle.ac_squared
                && min(triangle.ab_squared, triangle.ac_squared)
                    > 1e-16 * max(triangle.ab_squared, triangle.ac_squared))
    }

    #[test]
    fn a_distance_is_no_larger_than_that_to_any_point_of_the_triangle() {
        let mut number = numbers(7);
        for (triangle, seed) in triangles().filter(is_exact).zip(10..) {
            let [a, b, c] = triangle.corners();
            for p in points(&triangle, seed) {
                let found = triangle.squared_to(p).sqrt();
                let size = (b - a).length() + (c - a).length() + (p - a).length();
                for _ in 0..4 {
                    let (v, w) = (number().abs(), number().abs());
                    let (v, w) = if v + w > 1.0 { (1.0 - v, 1.0 - w) } else { (v, w) };
                    let other = (p - (a + (b - a) * v + (c - a) * w)).length();
                    assert!(found <= other + 1e-8 * size + 1e-15, "{triangle:?} {p}: {found} and {other}");
                }
            }
        }
    }

    #[test]
    fn bounds_lie_on_both_sides_of_the_distance_and_most_of_them_near_it() {
        let (mut all, mut near, mut beyond, mut detected) = (0, 0, 0, 0);
        for (triangle, seed) in triangles().filter(is_exact).zip(10..) {
            for p in points(&triangle, seed) {
                let squared = triangle.squared_to(p);
                assert!(squared <= triangle.at_most(p), "{triangle:?} {p}: {squared}");
                assert!(!triangle.is_beyond(p, squared), "{triangle:?} {p}: {squared}");
                if triangle.inverse > 0.0 {
                    all += 1;
                    near += usize::from(triangle.at_most(p) <= 2.0 * squared);
                    let [a, b, c] = triangle.corners();
                    let (u, v) = (1.0 / 3.0, triangle.ab.cross(triangle.ac).normalize());
                    let inside = a * u + b * u + c * u;
                    let beside = (p - inside).reject_from_normalized(v).length() > 2.0 * (c - b).length();
                    beyond += usize::from(beside);
                    detected += usize::from(beside && triangle.is_beyond(p, squared / 100.0));
                }
            }
        }
        assert!(2 * near > all && 2 * detected > beyond);
    }

    #[test]
    fn a_triangle_whose_squares_underflow_has_bounds() {
        for size in [1e-70, 1e-80, 1e-90, 1e-170] {
            let triangle = DistanceTriangle::new([DVec3::ZERO, DVec3::X * size, DVec3::Y * size]);
            let p = DVec3::new(2.0, 2.0, 1.0) * size;
            assert!(triangle.squared_to(p) <= triangle.at_most(p));
            assert!(!triangle.is_beyond(p, triangle.squared_to(p)));
        }
    }
}
