//! The quadric error (M. Garland and P. Heckbert, "Surface Simplification Using Quadric Error Metrics", SIGGRAPH 1997):
//! a sum of weighted squared distances to planes.

use glam::DVec3;

/// A sum of `weight * distance^2` over planes, as a function of a point given relative to the quadric's own origin.
///
/// The origin lies on the surface, so that the terms that cancel are as small as the local shape. A quadric's
/// precision therefore does not depend on the mesh's position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quadric {
    xx: f64,
    xy: f64,
    xz: f64,
    yy: f64,
    yz: f64,
    zz: f64,
    linear: DVec3,
    constant: f64,
}

impl Quadric {
    /// The quadric of the plane through `point` (relative to the origin) with a unit `normal`.
    pub fn plane(normal: DVec3, point: DVec3, weight: f64) -> Quadric {
        let (n, offset) = (normal, -normal.dot(point));
        Quadric {
            xx: weight * n.x * n.x,
            xy: weight * n.x * n.y,
            xz: weight * n.x * n.z,
            yy: weight * n.y * n.y,
            yz: weight * n.y * n.z,
            zz: weight * n.z * n.z,
            linear: weight * offset * n,
            constant: weight * offset * offset,
        }
    }

    /// Reads both ends, which may lie in different CPU cache lines.
    pub fn touch(&self) -> f64 {
        self.xx + self.constant
    }

    fn product(&self, v: DVec3) -> DVec3 {
        DVec3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// The sum at `point`, never negative despite rounding.
    pub fn at(&self, point: DVec3) -> f64 {
        (self.product(point).dot(point) + 2.0 * self.linear.dot(point) + self.constant).max(0.0)
    }

    /// The sum at the origin.
    pub fn at_origin(&self) -> f64 {
        self.constant
    }

    /// This quadric about another origin. `origin` is relative to the old one.
    pub fn about(&self, origin: DVec3) -> Quadric {
        Quadric { linear: self.linear + self.product(origin), constant: self.at(origin), ..*self }
    }

    /// Adds another quadric about the same origin.
    pub fn add(&mut self, other: &Quadric) {
        self.xx += other.xx;
        self.xy += other.xy;
        self.xz += other.xz;
        self.yy += other.yy;
        self.yz += other.yz;
        self.zz += other.zz;
        self.linear += other.linear;
        self.constant += other.constant;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadric_is_the_weighted_sum_of_squared_distances_about_any_origin() {
        let normal = DVec3::new(2.0, -1.0, 2.0) / 3.0;
        let mut quadric = Quadric::plane(normal, DVec3::new(1.0, 0.0, 0.0), 0.5);
        quadric.add(&Quadric::plane(DVec3::Z, DVec3::new(0.0, 0.0, 3.0), 2.0));
        let at = |p: DVec3| 0.5 * (normal.dot(p) - 2.0 / 3.0).powi(2) + 2.0 * (p.z - 3.0).powi(2);
        let origin = DVec3::new(-4.0, 5.0, 6.0);
        let moved = quadric.about(origin);
        for point in [DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), DVec3::new(-7.0, 0.5, 9.0)] {
            assert!((quadric.at(point) - at(point)).abs() < 1e-12);
            assert!((moved.at(point - origin) - at(point)).abs() < 1e-12);
        }
        assert_eq!(moved.at_origin(), moved.at(DVec3::ZERO));
    }
}
