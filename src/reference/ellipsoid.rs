//! The intersection of a ray with the WGS84 ellipsoid, in closed form: the truth for round surfaces, without a mesh.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Semi-axes in metres: the radius at the equator twice, and the distance from the centre to a pole (NIMA TR8350.2,
/// table 3.1).
const AXES_M: [f64; 3] = [6_378_137.0, 6_378_137.0, 6_356_752.314_245_179];

/// (s, t) of a ray's first intersection, both from 0 to 1: s is the longitude, eastwards from -180 degrees; t is the
/// geodetic latitude, southwards from the north pole. `None` if the ray misses the ellipsoid or begins inside it.
/// Positions are in earth-centred metres; `direction` may have any length.
pub fn coordinate(eye: [f64; 3], direction: [f64; 3]) -> Option<[f64; 2]> {
    // On a sphere of radius 1: (o + t d)^2 = 1.
    let [o, d] = [eye, direction].map(|of| [0, 1, 2].map(|c| of[c] / AXES_M[c]));
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (a, b, c) = (dot(d, d), dot(o, d), dot(o, o) - 1.0);
    let discriminant = b * b - a * c;
    if c <= 0.0 || b >= 0.0 || discriminant < 0.0 {
        return None;
    }
    // The nearer root, in a form that avoids cancellation.
    let t = c / (discriminant.sqrt() - b);
    let [x, y, z] = [0, 1, 2].map(|axis| eye[axis] + t * direction[axis]);
    // Geodetic latitude: the angle between the normal and the equatorial plane.
    let latitude = (z * AXES_M[0].powi(2)).atan2(x.hypot(y) * AXES_M[2].powi(2));
    Some([y.atan2(x) / TAU + 0.5, (FRAC_PI_2 - latitude) / PI])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_to_the_centre_meets_the_surface_below_the_eye() {
        for (eye, expected) in [
            ([2e7, 0.0, 0.0], [0.5, 0.5]),
            ([0.0, 2e7, 0.0], [0.75, 0.5]),
            ([0.0, -2e7, 0.0], [0.25, 0.5]),
            ([1.0, 0.0, 2e7], [0.5, 0.0]),
        ] {
            let found = coordinate(eye, eye.map(|c| -c)).unwrap();
            let off = (0..2).map(|n| (found[n] - expected[n]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-7, "{eye:?}: {found:?}");
            assert_eq!(coordinate(eye, eye), None, "away from it");
        }
    }

    /// A ray opposite to the normal of a point at latitude 45 degrees returns latitude 45 degrees.
    #[test]
    fn latitudes_are_geodetic() {
        let [a, _, b] = AXES_M.map(|axis| axis * axis);
        let at = [a / (a + b).sqrt(), 0.0, b / (a + b).sqrt()];
        let eye = [at[0] + 1e6, 0.0, at[2] + 1e6];
        let [s, t] = coordinate(eye, [-1.0, 0.0, -1.0]).unwrap();
        assert!((s - 0.5).abs() < 1e-12 && (t - 0.25).abs() < 1e-12, "{s} {t}");
    }

    /// At the planet's edge: a ray at the angle asin(radius / distance) to the direction of the centre touches the
    /// equator.
    #[test]
    fn the_disc_ends_where_rays_touch() {
        let (distance, limb) = (2e7f64, (AXES_M[0] / 2e7).asin());
        let towards = |angle: f64| [-angle.cos(), angle.sin(), 0.0];
        assert!(coordinate([distance, 0.0, 0.0], towards(limb - 1e-9)).is_some());
        assert_eq!(coordinate([distance, 0.0, 0.0], towards(limb + 1e-9)), None);
        // At the point of contact, the longitude is the complement of the angle.
        let [s, _] = coordinate([distance, 0.0, 0.0], towards(limb - 1e-12)).unwrap();
        assert!(((s - 0.5) * TAU - (FRAC_PI_2 - limb)).abs() < 1e-4, "{s}");
    }
}
