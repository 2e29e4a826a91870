//! Camera paths: one pose for every frame. Poses move by rigid rotations and translations, never by changing
//! latitude, longitude or heading, so poles and the antimeridian need no special case.

use super::camera::{Camera, Ground, near_m};
use crate::math::camera::Pose;
use crate::math::geodesy;
use glam::{DQuat, DVec3};
use serde::Serialize;

/// Frames of a path per second: when the window plays it, in the films, and in `render --path`.
pub const FRAMES_PER_SECOND: u16 = 30;

/// A camera path: frame 0 is the start, frame `frames` the end; later frames stay at the end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CameraPath {
    /// Number of steps, >= 1.
    pub frames: u32,
    pub motion: Motion,
}

/// The kind of motion. Angle, distance or the logarithm of the altitude change in equal steps; a teleport jumps.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Motion {
    /// Circles around the ground normal at the centre of the picture; positive degrees are counter-clockwise seen
    /// from above.
    Orbit { start: Camera, degrees: f64 },
    /// Along the great circle (on a plane: the straight line) with initial direction `heading_deg`, for `distance_m`
    /// on the ground, at constant altitude. The view keeps its orientation relative to that line.
    Pan { start: Camera, heading_deg: f64, distance_m: f64 },
    /// Straight up or down; the logarithm of the altitude changes linearly.
    Dive { start: Camera, to_altitude_m: f64 },
    /// Stays at each camera for an equal share of the frames, then jumps.
    Teleport { stops: Vec<Camera> },
}

impl CameraPath {
    /// The camera pose of a frame.
    pub fn pose(&self, frame: u32) -> Pose {
        self.pose_at(f64::from(frame))
    }

    /// The camera pose at any position, in frames from the start.
    pub fn pose_at(&self, frame: f64) -> Pose {
        let done = frame.min(f64::from(self.frames)) / f64::from(self.frames);
        match &self.motion {
            Motion::Orbit { start, degrees } => orbit(start, done * degrees),
            Motion::Pan { start, heading_deg, distance_m } => pan(start, *heading_deg, done * distance_m),
            Motion::Dive { start, to_altitude_m } => {
                // powf(0) is exactly 1: frame 0 is the start itself.
                climb(start, start.altitude_m * (to_altitude_m / start.altitude_m).powf(done))
            }
            Motion::Teleport { stops } => {
                // Frame `frames` belongs to the last stop.
                let stop = frame as u64 * stops.len() as u64 / u64::from(self.frames);
                stops[(stop as usize).min(stops.len() - 1)].pose()
            }
        }
    }

    /// Checks that every frame has a pose.
    ///
    /// # Errors
    /// The fault of the path's camera.
    pub fn check(&self) -> Result<(), &'static str> {
        match &self.motion {
            Motion::Orbit { start, .. } if middle_of_the_picture(start).is_none() => Err(
                "an orbit needs a camera that looks at the ground; this one looks above the horizon: lower its tilt",
            ),
            _ => Ok(()),
        }
    }
}

/// The ground point at the centre of the picture, and the ground normal there.
fn middle_of_the_picture(camera: &Camera) -> Option<(DVec3, DVec3)> {
    let pose = camera.pose();
    match camera.place.ground() {
        Ground::Planet => {
            let point = geodesy::ray_to_ellipsoid(pose.eye, pose.forward)?;
            Some((point, up_at(Ground::Planet, point)))
        }
        Ground::Plane => {
            let distance_m = -pose.eye.z / pose.forward.z;
            (distance_m > 0.0 && distance_m.is_finite())
                .then(|| (pose.eye + pose.forward * distance_m, DVec3::Z))
        }
    }
}

fn up_at(ground: Ground, position: DVec3) -> DVec3 {
    match ground {
        Ground::Planet => {
            let place = geodesy::ecef_to_geodetic(position);
            geodesy::local_frame(place.latitude_deg, place.longitude_deg).up
        }
        Ground::Plane => DVec3::Z,
    }
}

fn orbit(start: &Camera, degrees: f64) -> Pose {
    let (centre, axis) = middle_of_the_picture(start).expect("checked when the scene was read");
    let pose = start.pose().rotated(DQuat::from_axis_angle(axis, degrees.to_radians()), centre);
    at_altitude(start, pose)
}

fn pan(start: &Camera, heading_deg: f64, distance_m: f64) -> Pose {
    let pose = start.pose();
    let frame = start.place.frame();
    let (sin_heading, cos_heading) = heading_deg.to_radians().sin_cos();
    let ahead = frame.north * cos_heading + frame.east * sin_heading;
    match start.place.ground() {
        Ground::Plane => pose.moved(ahead * distance_m),
        Ground::Planet => {
            let axis = pose.eye.cross(ahead).normalize();
            let angle_rad = distance_m / geodesy::MEAN_RADIUS_M;
            at_altitude(start, pose.rotated(DQuat::from_axis_angle(axis, angle_rad), DVec3::ZERO))
        }
    }
}

/// Shifts the camera along the ground normal to the start's altitude. A rotation about the earth's centre alone would
/// change the altitude by up to 21 km between equator and pole.
fn at_altitude(start: &Camera, pose: Pose) -> Pose {
    match start.place.ground() {
        Ground::Plane => pose,
        Ground::Planet => {
            let rise_m = start.altitude_m - geodesy::ecef_to_geodetic(pose.eye).altitude_m;
            pose.moved(up_at(Ground::Planet, pose.eye) * rise_m)
        }
    }
}

fn climb(start: &Camera, altitude_m: f64) -> Pose {
    let up = start.place.frame().up;
    let pose = start.pose().moved(up * (altitude_m - start.altitude_m));
    Pose { near_m: near_m(altitude_m), height_m: altitude_m, ..pose }
}

#[cfg(test)]
mod tests {
    use super::super::camera::GroundPoint;
    use super::*;

    fn start(latitude_deg: f64, longitude_deg: f64, tilt_deg: f64) -> Camera {
        Camera {
            place: GroundPoint::Planet { latitude_deg, longitude_deg },
            altitude_m: 50e3,
            heading_deg: 0.0,
            tilt_deg,
            vertical_fov_deg: 60.0,
            magnification: 1.0,
            near_m: None,
        }
    }

    fn is_orthonormal(pose: &Pose) {
        assert!((pose.right.cross(pose.up) + pose.forward).length() < 1e-14, "{pose:?}");
        assert!((pose.right.length() - 1.0).abs() < 1e-14);
        assert!(pose.up.dot(pose.forward).abs() < 1e-14);
    }

    /// Asserts that every frame moves as far as the first (to 0.1 %) and hardly rotates.
    fn is_smooth(path: &CameraPath) {
        let first_m = path.pose(0).eye.distance(path.pose(1).eye);
        for frame in 0..path.frames {
            let (here, next) = (path.pose(frame), path.pose(frame + 1));
            is_orthonormal(&here);
            let step_m = here.eye.distance(next.eye);
            assert!((step_m / first_m - 1.0).abs() < 1e-3, "frame {frame}: {step_m} m, first {first_m} m");
            assert!(here.up.dot(next.up) > 0.9999, "frame {frame} turns");
        }
    }

    #[test]
    fn a_pan_over_the_pole_is_smooth_and_holds_its_altitude() {
        let path = CameraPath {
            frames: 100,
            motion: Motion::Pan { start: start(89.0, 12.0, 30.0), heading_deg: 0.0, distance_m: 222e3 },
        };
        is_smooth(&path);
        for frame in 0..=100 {
            let place = geodesy::ecef_to_geodetic(path.pose(frame).eye);
            assert!((place.altitude_m - 50e3).abs() < 1e-6, "{place:?}");
        }
        let end = geodesy::ecef_to_geodetic(path.pose(100).eye);
        assert!((end.longitude_deg - (12.0 - 180.0)).abs() < 1e-6, "beyond the pole: {end:?}");
        let nearest = geodesy::ecef_to_geodetic(path.pose(50).eye);
        assert!(nearest.latitude_deg > 89.99, "{nearest:?}");
    }

    #[test]
    fn a_pan_over_the_antimeridian_is_smooth() {
        let path = CameraPath {
            frames: 60,
            motion: Motion::Pan { start: start(-17.0, 179.0, 0.0), heading_deg: 90.0, distance_m: 250e3 },
        };
        is_smooth(&path);
        let end = geodesy::ecef_to_geodetic(path.pose(60).eye);
        assert!(end.longitude_deg < -178.0, "{end:?}");
    }

    #[test]
    fn an_orbit_keeps_its_point_in_the_middle_and_closes() {
        let camera = start(46.0, 8.0, 50.0);
        let path = CameraPath { frames: 36, motion: Motion::Orbit { start: camera, degrees: 360.0 } };
        assert_eq!(path.check(), Ok(()));
        let (centre, _) = middle_of_the_picture(&camera).unwrap();
        for frame in 0..=36 {
            let pose = path.pose(frame);
            is_orthonormal(&pose);
            // The ellipsoid is not a sphere: keeping the altitude moves the orbit's centre by up to 0.2 mrad, seen
            // from the camera.
            let aside = (centre - pose.eye).normalize().cross(pose.forward).length();
            assert!(aside < 1e-3, "frame {frame}: {aside} rad");
        }
        assert!(path.pose(36).eye.distance(camera.pose().eye) < 1e-6);
    }

    #[test]
    fn an_orbit_around_the_sky_is_refused() {
        let path =
            CameraPath { frames: 3, motion: Motion::Orbit { start: start(0.0, 0.0, 100.0), degrees: 9.0 } };
        assert!(path.check().is_err());
    }

    #[test]
    fn a_dive_divides_the_altitude_by_the_same_factor_in_each_frame() {
        let path = CameraPath {
            frames: 4,
            motion: Motion::Dive { start: start(46.0, 8.0, 0.0), to_altitude_m: 5.0 },
        };
        let altitude_m = |frame| geodesy::ecef_to_geodetic(path.pose(frame).eye).altitude_m;
        for frame in 0..4 {
            assert!((altitude_m(frame) / altitude_m(frame + 1) - 10.0).abs() < 1e-6);
        }
        assert_eq!(path.pose(99), path.pose(4), "the end is held");
        let between = geodesy::ecef_to_geodetic(path.pose_at(1.5).eye).altitude_m;
        assert!((between.powi(2) / (altitude_m(1) * altitude_m(2)) - 1.0).abs() < 1e-6, "{between} m");
    }

    #[test]
    fn a_teleport_stays_at_each_stop_for_its_share() {
        let stops = vec![start(0.0, 0.0, 0.0), start(1.0, 0.0, 0.0), start(2.0, 0.0, 0.0)];
        let path = CameraPath { frames: 6, motion: Motion::Teleport { stops: stops.clone() } };
        let seen: Vec<usize> = (0..8)
            .map(|frame| stops.iter().position(|stop| stop.pose() == path.pose(frame)).unwrap())
            .collect();
        assert_eq!(seen, [0, 0, 1, 1, 2, 2, 2, 2]);
    }
}
