//! Cameras of a scene: a position on the ground, a height above it, and a direction.

use crate::math::camera::Pose;
use crate::math::geodesy::{self, LocalFrame};
use glam::{DMat3, DVec3};
use serde::Serialize;

/// The ground below the camera. It defines altitude, north, and the course of a pan (great circle or straight line).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Ground {
    /// The WGS84 ellipsoid in earth-centred metres.
    Planet,
    /// The plane z = 0: x to the east, y to the north.
    Plane,
}

/// The point of the ground below the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum GroundPoint {
    /// Geodetic degrees.
    Planet { latitude_deg: f64, longitude_deg: f64 },
    /// Metres from the centre of the plane.
    Plane { east_m: f64, north_m: f64 },
}

impl GroundPoint {
    pub fn ground(&self) -> Ground {
        match self {
            GroundPoint::Planet { .. } => Ground::Planet,
            GroundPoint::Plane { .. } => Ground::Plane,
        }
    }

    /// East, north and up at this point.
    pub fn frame(&self) -> LocalFrame {
        match *self {
            GroundPoint::Planet { latitude_deg, longitude_deg } => {
                geodesy::local_frame(latitude_deg, longitude_deg)
            }
            GroundPoint::Plane { .. } => LocalFrame { east: DVec3::X, north: DVec3::Y, up: DVec3::Z },
        }
    }

    /// World position in metres, `altitude_m` above this point.
    pub fn above(&self, altitude_m: f64) -> DVec3 {
        match *self {
            GroundPoint::Planet { latitude_deg, longitude_deg } => {
                geodesy::geodetic_to_ecef(latitude_deg, longitude_deg, altitude_m)
            }
            GroundPoint::Plane { east_m, north_m } => DVec3::new(east_m, north_m, altitude_m),
        }
    }
}

/// A named camera of a scene. Its numbers are finite and in range (checked when the scene is read).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Camera {
    #[serde(flatten)]
    pub place: GroundPoint,
    /// Height of the camera above the ground, > 0.
    pub altitude_m: f64,
    /// Direction of view, clockwise from north; when looking straight down, the picture's up direction.
    pub heading_deg: f64,
    /// 0 is straight down, 90 horizontal in the direction of the heading, 180 straight up.
    pub tilt_deg: f64,
    /// Angle between the picture's top and bottom edges, before magnification.
    pub vertical_fov_deg: f64,
    /// Divides the tangent of half the angle: 4 shows a quarter of the width and height.
    pub magnification: f64,
    /// Distance of the near plane; by default a 64th of the altitude ([`near_m`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub near_m: Option<f64>,
}

impl Camera {
    /// The camera with the pose `pose`, and with the field of view and the near plane of `like`. Roll is lost. When
    /// looking straight up or down, the heading is the picture's up direction.
    pub fn from_pose(pose: &Pose, like: &Camera) -> Camera {
        let (place, altitude_m) = match like.place.ground() {
            Ground::Planet => {
                let geodesy::Geodetic { latitude_deg, longitude_deg, altitude_m } =
                    geodesy::ecef_to_geodetic(pose.eye);
                (GroundPoint::Planet { latitude_deg, longitude_deg }, altitude_m)
            }
            Ground::Plane => (GroundPoint::Plane { east_m: pose.eye.x, north_m: pose.eye.y }, pose.eye.z),
        };
        let LocalFrame { east, north, up } = place.frame();
        // As in `pose`: forward = ahead sin - up cos, image_up = ahead cos + up sin.
        let (sin_tilt, cos_tilt) = (pose.up.dot(up).max(0.0), -pose.forward.dot(up));
        let ahead = pose.forward * sin_tilt + pose.up * cos_tilt;
        Camera {
            place,
            altitude_m,
            heading_deg: ahead.dot(east).atan2(ahead.dot(north)).to_degrees(),
            tilt_deg: sin_tilt.atan2(cos_tilt).to_degrees(),
            ..*like
        }
    }

    /// The TOML table `[cameras.NAME]` of this camera.
    pub fn to_toml(&self, name: &str) -> String {
        let keys = toml::to_string(self).expect("a camera is a table of numbers");
        format!("[cameras.{name}]\n{keys}")
    }

    /// The override that adds this camera to a scene as `name`, or replaces it.
    pub fn to_change(&self, name: &str) -> String {
        let keys = toml::Value::try_from(self).expect("a camera is a table of numbers");
        let keys = keys.as_table().into_iter().flatten().map(|(key, value)| format!("{key} = {value}"));
        format!("cameras.{name}={{ {} }}", keys.collect::<Vec<_>>().join(", "))
    }

    /// The camera's pose in world metres.
    pub fn pose(&self) -> Pose {
        let LocalFrame { east, north, up } = self.place.frame();
        let (sin_heading, cos_heading) = self.heading_deg.to_radians().sin_cos();
        let (sin_tilt, cos_tilt) = self.tilt_deg.to_radians().sin_cos();
        let ahead = north * cos_heading + east * sin_heading;
        let forward = ahead * sin_tilt - up * cos_tilt;
        let image_up = ahead * cos_tilt + up * sin_tilt;
        Pose {
            eye: self.place.above(self.altitude_m),
            right: forward.cross(image_up),
            up: image_up,
            forward,
            vertical_fov_rad: self.vertical_fov_rad(),
            near_m: self.near_m.unwrap_or_else(|| near_m(self.altitude_m)),
            height_m: self.altitude_m,
        }
    }

    /// Full vertical angle, magnification included.
    pub fn vertical_fov_rad(&self) -> f64 {
        let tan_half = (0.5 * self.vertical_fov_deg.to_radians()).tan() / self.magnification;
        2.0 * tan_half.atan()
    }
}

/// Near plane of a camera `altitude_m` above the ground. The ground is never nearer than the altitude, because a mesh
/// of chords lies below the ellipsoid. So the ground is visible in all pixels whose rays deviate from the axis by at
/// most acos(1/64) = 89.1 degrees. With reversed float depth, the factor 1/64 costs no precision.
pub fn near_m(altitude_m: f64) -> f64 {
    altitude_m / 64.0
}

/// Extrapolates a camera's motion by `frames` frames: the rigid motion from `before` to `now` is repeated. Stops
/// before the camera has moved farther than half its height, so that it never goes below the ground. `None` if a
/// single frame moves further than that (a jump), or if the camera is at rest.
pub fn extrapolated(before: &Pose, now: &Pose, frames: u32) -> Option<Pose> {
    if (before.eye, before.forward, before.up) == (now.eye, now.forward, now.up) {
        return None;
    }
    let axes = |pose: &Pose| DMat3::from_cols(pose.right, pose.up, pose.forward);
    let turn = axes(now) * axes(before).transpose();
    let farthest_m = now.height_m / 2.0;
    let step = |pose: &Pose| Pose {
        eye: turn * (pose.eye - before.eye) + now.eye,
        right: turn * pose.right,
        up: turn * pose.up,
        forward: turn * pose.forward,
        ..*pose
    };
    let ahead = std::iter::successors(Some(*now), |pose| Some(step(pose)))
        .skip(1)
        .take(frames as usize)
        .take_while(|pose| pose.eye.distance(now.eye) <= farthest_m)
        .last()?;
    // At least half the height remains, so half the near distance is still safe.
    Some(Pose { near_m: now.near_m / 2.0, height_m: farthest_m, ..ahead })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(place: GroundPoint, heading_deg: f64, tilt_deg: f64) -> Camera {
        Camera {
            place,
            altitude_m: 300e3,
            heading_deg,
            tilt_deg,
            vertical_fov_deg: 60.0,
            magnification: 4.0,
            near_m: None,
        }
    }

    #[test]
    fn straight_down_with_heading_0_has_north_up_and_east_right() {
        let place = GroundPoint::Planet { latitude_deg: 46.0, longitude_deg: 8.0 };
        let (pose, frame) = (camera(place, 0.0, 0.0).pose(), place.frame());
        assert!((pose.forward + frame.up).length() < 1e-15);
        assert!((pose.up - frame.north).length() < 1e-15);
        assert!((pose.right - frame.east).length() < 1e-15);
    }

    #[test]
    fn tilt_90_looks_along_the_heading_with_the_sky_up() {
        let place = GroundPoint::Plane { east_m: 0.0, north_m: 0.0 };
        let pose = camera(place, 90.0, 90.0).pose();
        assert!((pose.forward - DVec3::X).length() < 1e-15, "{pose:?}");
        assert!((pose.up - DVec3::Z).length() < 1e-15, "{pose:?}");
        assert!((pose.right + DVec3::Y).length() < 1e-15, "looking east, right is south: {pose:?}");
    }

    #[test]
    fn a_camera_is_recovered_from_its_pose_even_at_the_pole_and_straight_down() {
        let planet = |latitude_deg, longitude_deg| GroundPoint::Planet { latitude_deg, longitude_deg };
        let places = [
            planet(46.0, 8.0),
            planet(89.999_999, -120.0),
            GroundPoint::Plane { east_m: 5.0, north_m: -7.0 },
        ];
        for (place, altitude_m) in places.into_iter().flat_map(|place| [1.0, 1e4, 1e8].map(|m| (place, m))) {
            for (heading_deg, tilt_deg) in [(0.0, 0.0), (-120.0, 0.0), (75.0, 60.0), (180.0, 179.0)] {
                let camera = Camera { altitude_m, ..camera(place, heading_deg, tilt_deg) };
                let (pose, found) = (camera.pose(), Camera::from_pose(&camera.pose(), &camera));
                let again = found.pose();
                // One ulp of the eye's distance from the earth's centre is 1e-9 m; it is magnified near the pole.
                assert!(again.eye.distance(pose.eye) < 1e-7 + 1e-15 * altitude_m, "{camera:?} {found:?}");
                assert!(again.forward.distance(pose.forward) < 1e-7, "{camera:?} {found:?}");
                assert!(again.up.distance(pose.up) < 1e-7, "{camera:?} {found:?}");
            }
        }
    }

    #[test]
    fn a_camera_written_as_toml_is_the_same_to_the_last_bit() {
        let place = GroundPoint::Planet { latitude_deg: 0.1 + 0.2, longitude_deg: -1e-300 };
        let camera = Camera { altitude_m: 1.0 / 3.0, ..camera(place, 1e-17, 60.0) };
        let scene = crate::scene::Scene::embedded("globe").unwrap();
        let scene = scene.with(&[camera.to_change("window"), "view.camera=window".to_owned()]).unwrap();
        assert_eq!(scene.cameras["window"], camera);
        let text: toml::Table = camera.to_toml("window").parse().unwrap();
        let altitude_m = text["cameras"]["window"]["altitude_m"].as_float().unwrap();
        assert_eq!(altitude_m.to_bits(), camera.altitude_m.to_bits());
    }

    #[test]
    fn magnification_4_narrows_the_tangent_to_a_quarter() {
        let camera = camera(GroundPoint::Plane { east_m: 0.0, north_m: 0.0 }, 0.0, 0.0);
        let tangent = (camera.vertical_fov_rad() / 2.0).tan();
        assert!((tangent - (30f64.to_radians().tan() / 4.0)).abs() < 1e-16);
    }
}
