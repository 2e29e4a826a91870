//! Where a ray meets the inside of a cylinder, in closed form: the reference for a tunnel, without a mesh.

use std::f64::consts::TAU;

/// A cylinder that lies on the plane z = 0 along the y axis, from y = 0 to the north. Metres.
#[derive(Clone, Copy, Debug)]
pub struct CylinderWall {
    pub radius_m: f64,
    pub length_m: f64,
}

impl CylinderWall {
    /// (s, t) of the point at which a ray from inside meets the wall. Both run from 0 to 1: s once around from the top,
    /// counter-clockwise seen from the south, and t from the northern end to the southern end. `None` if the ray leaves
    /// by an end, or begins outside the radius. The direction has any length.
    pub fn coordinate(&self, eye: [f64; 3], direction: [f64; 3]) -> Option<[f64; 2]> {
        let ([x, y, z], [dx, dy, dz]) = (eye, direction);
        let z = z - self.radius_m;
        // |(x, z) + k (dx, dz)| = radius, the positive root.
        let (a, b, c) = (dx * dx + dz * dz, x * dx + z * dz, x * x + z * z - self.radius_m.powi(2));
        if c >= 0.0 || a == 0.0 {
            return None;
        }
        let root = (b * b - a * c).sqrt();
        // This form of the root avoids cancellation.
        let k = if b > 0.0 { -c / (root + b) } else { (root - b) / a };
        let along = (y + k * dy) / self.length_m;
        let around = (-x - k * dx).atan2(z + k * dz) / TAU;
        (0.0..=1.0).contains(&along).then_some([around.rem_euclid(1.0), 1.0 - along])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TUNNEL: CylinderWall = CylinderWall { radius_m: 2.0, length_m: 10.0 };

    #[test]
    fn rays_across_meet_top_sides_and_floor() {
        for (direction, around) in [
            ([0.0, 0.0, 1.0], 0.0),
            ([1.0, 0.0, 0.0], 0.75),
            ([0.0, 0.0, -1.0], 0.5),
            ([-3.0, 0.0, 0.0], 0.25),
        ] {
            let [s, t] = TUNNEL.coordinate([0.0, 2.5, 2.0], direction).unwrap();
            assert!((s - around).abs() < 1e-15 && (t - 0.75).abs() < 1e-15, "{direction:?}: {s} {t}");
        }
    }

    #[test]
    fn a_ray_along_the_tunnel_meets_the_wall_where_its_slope_says() {
        let eye = [0.5, 1.0, 2.0];
        // The ray moves 1.5 m sideways over 6 m, from x = 0.5 m to the wall at 2 m.
        let [s, t] = TUNNEL.coordinate(eye, [0.25, 1.0, 0.0]).unwrap();
        assert!((s - 0.75).abs() < 1e-15 && (t - 0.3).abs() < 1e-15, "{s} {t}");
        let [s, _] = TUNNEL.coordinate(eye, [-0.5, 1.0, 0.0]).unwrap();
        assert!((s - 0.25).abs() < 1e-15, "{s}");
    }

    #[test]
    fn rays_out_of_an_end_and_from_outside_meet_nothing() {
        for (eye, direction) in [
            ([0.5, 1.0, 2.0], [0.0, 1.0, 0.0]),
            ([0.5, 1.0, 2.0], [0.1, 1.0, 0.0]),
            ([0.5, 1.0, 2.0], [0.1, -1.0, 0.0]),
            ([2.5, 1.0, 2.0], [-1.0, 0.0, 0.0]),
        ] {
            assert_eq!(TUNNEL.coordinate(eye, direction), None, "{eye:?} {direction:?}");
        }
    }
}
