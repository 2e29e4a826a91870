//! The WGS84 ellipsoid (NIMA TR8350.2, table 3.1) in earth-centred, earth-fixed metres. x points to longitude
//! 0 on the equator, z to the north pole. Everything is f64: one ulp of the earth's radius is 0.9 nm.

use glam::DVec3;

/// a: radius at the equator in metres.
pub const EQUATOR_RADIUS_M: f64 = 6_378_137.0;
/// f: flattening.
pub const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// b: distance from the centre to a pole in metres.
pub const POLE_RADIUS_M: f64 = EQUATOR_RADIUS_M * (1.0 - FLATTENING);
/// R1 = (2a + b) / 3: converts a ground distance to an angle at the centre.
pub const MEAN_RADIUS_M: f64 = (2.0 * EQUATOR_RADIUS_M + POLE_RADIUS_M) / 3.0;

/// e^2 = f (2 - f): first eccentricity, squared.
const ECCENTRICITY_SQUARED: f64 = FLATTENING * (2.0 - FLATTENING);

/// A position above the ellipsoid (below it if the altitude is negative).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geodetic {
    pub latitude_deg: f64,
    pub longitude_deg: f64,
    pub altitude_m: f64,
}

/// Unit vectors to the east, to the north and along the ellipsoid's outward normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFrame {
    pub east: DVec3,
    pub north: DVec3,
    pub up: DVec3,
}

/// Position in metres of geodetic coordinates.
pub fn geodetic_to_ecef(latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> DVec3 {
    let (sin_lat, cos_lat) = latitude_deg.to_radians().sin_cos();
    let (sin_lon, cos_lon) = longitude_deg.to_radians().sin_cos();
    // N: distance along the normal from the surface to the earth's axis.
    let prime_vertical_m = EQUATOR_RADIUS_M / (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat).sqrt();
    let from_axis_m = (prime_vertical_m + altitude_m) * cos_lat;
    let height_m = (prime_vertical_m * (1.0 - ECCENTRICITY_SQUARED) + altitude_m) * sin_lat;
    DVec3::new(from_axis_m * cos_lon, from_axis_m * sin_lon, height_m)
}

/// Geodetic coordinates of a position in metres. On the axis the longitude is that of `atan2(y, x)`.
///
/// Bowring's iteration on the parametric latitude (Survey Review 23, 1976). From -10 km to 10^8 m of altitude, three
/// iterations are exact to rounding; this uses six. Positions near the centre (within the evolute, 43 km) are not
/// supported, because several normals meet there.
pub fn ecef_to_geodetic(position: DVec3) -> Geodetic {
    let from_axis_m = position.x.hypot(position.y);
    // e'^2 b, for the parametric latitude beta: tan(beta) = (1 - f) tan(latitude).
    let second = ECCENTRICITY_SQUARED / (1.0 - ECCENTRICITY_SQUARED) * POLE_RADIUS_M;
    let mut beta = position.z.atan2((1.0 - FLATTENING) * from_axis_m);
    let mut latitude = 0.0;
    for _ in 0..6 {
        let (sin_beta, cos_beta) = beta.sin_cos();
        latitude = (position.z + second * sin_beta.powi(3))
            .atan2(from_axis_m - ECCENTRICITY_SQUARED * EQUATOR_RADIUS_M * cos_beta.powi(3));
        let (sin_lat, cos_lat) = latitude.sin_cos();
        beta = ((1.0 - FLATTENING) * sin_lat).atan2(cos_lat);
    }
    let (sin_lat, cos_lat) = latitude.sin_cos();
    // Well conditioned at the equator and at the poles, unlike from_axis_m / cos(latitude) - N.
    let altitude_m = from_axis_m * cos_lat + position.z * sin_lat
        - EQUATOR_RADIUS_M * (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat).sqrt();
    Geodetic {
        latitude_deg: latitude.to_degrees(),
        longitude_deg: position.y.atan2(position.x).to_degrees(),
        altitude_m,
    }
}

/// East, north and up at geodetic coordinates. At a pole: the limit along the given meridian.
pub fn local_frame(latitude_deg: f64, longitude_deg: f64) -> LocalFrame {
    let (sin_lat, cos_lat) = latitude_deg.to_radians().sin_cos();
    let (sin_lon, cos_lon) = longitude_deg.to_radians().sin_cos();
    LocalFrame {
        east: DVec3::new(-sin_lon, cos_lon, 0.0),
        north: DVec3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat),
        up: DVec3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat),
    }
}

/// First intersection of the ellipsoid with a ray from `eye` along the unit vector `direction`. `None` if the ray
/// misses the ellipsoid or starts inside it.
pub fn ray_to_ellipsoid(eye: DVec3, direction: DVec3) -> Option<DVec3> {
    let radii_m = DVec3::new(EQUATOR_RADIUS_M, EQUATOR_RADIUS_M, POLE_RADIUS_M);
    // The unit sphere in scaled space: |o + k d|^2 = 1.
    let (origin, step) = (eye / radii_m, direction / radii_m);
    let (a, half_b, c) = (step.dot(step), origin.dot(step), origin.dot(origin) - 1.0);
    let discriminant = half_b * half_b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let distance_m = (-half_b - discriminant.sqrt()) / a;
    (distance_m > 0.0).then(|| eye + direction * distance_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ellipsoid_has_its_published_radii() {
        assert_eq!(geodetic_to_ecef(0.0, 0.0, 0.0), DVec3::new(6_378_137.0, 0.0, 0.0));
        let pole = geodetic_to_ecef(90.0, 0.0, 0.0);
        // b as published to 0.1 mm.
        assert!((pole.z - 6_356_752.314_2).abs() < 1e-4, "{pole}");
    }

    #[test]
    fn a_known_city_has_its_published_position() {
        // EPSG guidance note 7-2, worked example of geocentric conversion (EPSG:9602).
        let place =
            geodetic_to_ecef(53.0 + 48.0 / 60.0 + 33.820 / 3600.0, 2.0 + 7.0 / 60.0 + 46.380 / 3600.0, 73.0);
        let published = DVec3::new(3_771_793.968, 140_253.342, 5_124_304.349);
        assert!((place - published).abs().max_element() < 1e-3, "{place} {published}");
    }

    #[test]
    fn the_inverse_returns_the_coordinates_at_every_latitude_and_altitude() {
        for altitude_m in [-10_000.0, 0.0, 1.0, 300e3, 2e7, 1e8] {
            for latitude_deg in [-90.0, -89.999_999, -45.0, -1e-9, 0.0, 12.5, 60.0, 89.999, 90.0] {
                for longitude_deg in [-180.0, -179.5, 0.0, 33.0, 180.0] {
                    let position = geodetic_to_ecef(latitude_deg, longitude_deg, altitude_m);
                    let place = ecef_to_geodetic(position);
                    // 8 ulp of the distance from the centre.
                    let bound_m = 8.0 * f64::EPSILON * position.length();
                    assert!((place.altitude_m - altitude_m).abs() <= bound_m, "{place:?} {altitude_m}");
                    let back = geodetic_to_ecef(place.latitude_deg, place.longitude_deg, place.altitude_m);
                    assert!(back.distance(position) <= bound_m, "{place:?}: {back} {position}");
                }
            }
        }
    }

    #[test]
    fn the_frame_is_orthonormal_and_right_handed_including_a_pole() {
        for (latitude_deg, longitude_deg) in [(90.0, 77.0), (-90.0, 0.0), (46.0, 8.0), (0.0, 180.0)] {
            let LocalFrame { east, north, up } = local_frame(latitude_deg, longitude_deg);
            assert!((east.cross(north) - up).length() < 1e-15);
            assert!(east.dot(north).abs() < 1e-15);
            assert!((east.length() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn a_ray_straight_down_meets_the_ground_below_and_a_ray_up_nothing() {
        let up = local_frame(46.0, 8.0).up;
        let eye = geodetic_to_ecef(46.0, 8.0, 1e6);
        let ground = ray_to_ellipsoid(eye, -up).unwrap();
        assert!(ground.distance(geodetic_to_ecef(46.0, 8.0, 0.0)) < 1e-6);
        assert_eq!(ray_to_ellipsoid(eye, up), None);
    }
}
