//! Camera motion: dragging the ground, orbiting, flying, and transitions between two cameras.
//!
//! The state is a camera of the scene format, not a matrix. A report can therefore store the view and
//! reproduce it bit for bit.

use glam::{DQuat, DVec2, DVec3};
use ortelius::math::camera::Pose;
use ortelius::math::geodesy;
use ortelius::scene::camera::{Camera, Ground, GroundPoint, near_m};

/// Least and greatest height of the camera, in metres.
pub const LOWEST_M: f64 = 1.0;
pub const HIGHEST_M: f64 = 1e8;

/// Least height above terrain, in metres.
const CLEARANCE_M: f64 = 2.0;

/// Duration of a transition between two cameras, in seconds.
const FLIGHT_S: f64 = 0.9;

/// Longest step of the camera in one frame, in multiples of its height.
const LONGEST_STEP: f64 = 4.0;

/// The camera, and its current transition.
pub struct Eye {
    pub camera: Camera,
    way: Option<Way>,
    /// Height of the terrain below the camera. Flight speed and near plane follow from the camera's height above the
    /// terrain.
    ground_m: f64,
}

struct Way {
    from: Camera,
    to: Camera,
    /// Progress: 0 at the start, 1 at the end.
    done: f64,
}

impl Eye {
    pub fn new(camera: Camera) -> Eye {
        Eye { camera, way: None, ground_m: 0.0 }
    }

    /// True during a transition.
    pub fn is_under_way(&self) -> bool {
        self.way.is_some()
    }

    /// Sets the camera without a transition.
    pub fn set(&mut self, camera: Camera) {
        *self = Eye { ground_m: self.ground_m, ..Eye::new(camera) };
    }

    /// Height above the terrain, in metres.
    pub fn height_m(&self) -> f64 {
        (self.camera.altitude_m - self.ground_m).max(LOWEST_M)
    }

    /// Keeps the camera above terrain of height `ground_m`, and sets the near plane from the camera's height above the
    /// terrain. The camera is unchanged unless `ground_m` is positive.
    pub fn rise_above(&mut self, ground_m: f64) {
        self.ground_m = ground_m;
        if ground_m > 0.0 {
            self.camera.altitude_m = self.camera.altitude_m.max(ground_m + CLEARANCE_M);
            self.camera.near_m = Some(near_m(self.height_m()));
        }
    }

    /// Starts a transition to another camera over the same kind of ground: both on a plane, or both on a
    /// planet.
    pub fn fly_to(&mut self, to: Camera) {
        self.way = Some(Way { from: self.camera, to, done: 0.0 });
    }

    /// Advances the transition.
    pub fn advance(&mut self, seconds: f64) {
        let Some(way) = &mut self.way else { return };
        way.done = (way.done + seconds / FLIGHT_S).min(1.0);
        self.camera = way.camera();
        if way.done >= 1.0 {
            self.way = None;
        }
    }

    /// The ground under a pixel, in world metres.
    pub fn ground_at(&self, pixel: DVec2, size: [u32; 2]) -> Option<DVec3> {
        let pose = self.camera.pose();
        hit(&pose, ray(&pose, pixel, size), self.camera.place.ground())
    }

    /// Drags the ground: the point under `from` moves to `to`.
    pub fn drag(&mut self, from: DVec2, to: DVec2, size: [u32; 2]) {
        self.way = None;
        let (held, now) = (self.ground_at(from, size), self.ground_at(to, size));
        match (held, now) {
            (Some(held), Some(now)) => self.carry(now, held),
            // The pointer misses the ground: its motion is applied at a distance of the camera's height.
            _ => {
                let radians = self.camera.vertical_fov_rad() / f64::from(size[1].max(1));
                let metres = (from - to) * radians * self.camera.altitude_m;
                self.go(DVec3::new(metres.x, -metres.y, 0.0));
            }
        }
    }

    /// Moves the camera over the ground: the pixel that showed the point `from` then shows the point `to`.
    fn carry(&mut self, from: DVec3, to: DVec3) {
        let pose = self.camera.pose();
        let moved = match self.camera.place.ground() {
            Ground::Plane => {
                let by = (to - from).clamp_length_max(LONGEST_STEP * self.camera.altitude_m);
                pose.moved(DVec3::new(by.x, by.y, 0.0))
            }
            Ground::Planet => {
                let max = LONGEST_STEP * self.camera.altitude_m / geodesy::MEAN_RADIUS_M;
                let (axis, angle) = arc(from, to);
                pose.rotated(DQuat::from_axis_angle(axis, angle.min(max)), DVec3::ZERO)
            }
        };
        self.take(&moved, self.camera.altitude_m);
    }

    /// Sets the camera from a pose, with the given height.
    fn take(&mut self, pose: &Pose, altitude_m: f64) {
        let altitude_m = altitude_m.clamp(LOWEST_M, HIGHEST_M);
        self.camera = Camera { altitude_m, ..Camera::from_pose(pose, &self.camera) };
    }

    /// Moves by `by_m`: metres to the right, forward along the ground, and up.
    pub fn go(&mut self, by_m: DVec3) {
        self.way = None;
        let frame = self.camera.place.frame();
        let (sin, cos) = self.camera.heading_deg.to_radians().sin_cos();
        let ahead = frame.north * cos + frame.east * sin;
        let right = frame.east * cos - frame.north * sin;
        let max = LONGEST_STEP * self.camera.altitude_m;
        let over = (right * by_m.x + ahead * by_m.y).clamp_length_max(max);
        let pose = self.camera.pose();
        let moved = match self.camera.place.ground() {
            Ground::Plane => pose.moved(over),
            Ground::Planet => match pose.eye.cross(over).try_normalize() {
                Some(axis) => {
                    let angle = over.length() / geodesy::MEAN_RADIUS_M;
                    pose.rotated(DQuat::from_axis_angle(axis, angle), DVec3::ZERO)
                }
                None => pose,
            },
        };
        self.take(&moved, self.camera.altitude_m + by_m.z);
    }

    /// Orbits about the ground point in the middle of the picture. If there is no such point, or if it is at least 50
    /// times the camera's height away, turns about the camera. `by` is in pixels.
    pub fn turn(&mut self, by: DVec2, size: [u32; 2]) {
        self.way = None;
        let degrees = by * 180.0 / f64::from(size[1].max(1));
        let (pose, ground) = (self.camera.pose(), self.camera.place.ground());
        let near = |middle: &DVec3| middle.distance(pose.eye) < 50.0 * self.camera.altitude_m;
        let Some(middle) = hit(&pose, pose.forward, ground).filter(near) else {
            let tilt_deg = (self.camera.tilt_deg - degrees.y).clamp(0.0, 180.0);
            let heading_deg = wrapped(self.camera.heading_deg + degrees.x);
            self.camera = Camera { heading_deg, tilt_deg, ..self.camera };
            return;
        };
        let up = match ground {
            Ground::Plane => DVec3::Z,
            Ground::Planet => middle.normalize(),
        };
        let about = |pose: &Pose, axis: DVec3, degrees: f64| {
            pose.rotated(DQuat::from_axis_angle(axis, degrees.to_radians()), middle)
        };
        let turned = about(&pose, up, -degrees.x);
        let tilted = about(&turned, turned.right, -degrees.y);
        // Stops the pitch before the horizon, and keeps the camera upright.
        let upright = tilted.up.dot(up) > 0.0 && -tilted.forward.dot(up) > 0.02;
        let pose = if upright { tilted } else { turned };
        let found = Camera::from_pose(&pose, &self.camera);
        if (LOWEST_M..=HIGHEST_M).contains(&found.altitude_m) {
            self.camera = found;
        }
    }

    /// Multiplies the height by `factor`. The ground point under `pixel` keeps its pixel.
    pub fn zoom(&mut self, factor: f64, pixel: DVec2, size: [u32; 2]) {
        self.way = None;
        let held = self.ground_at(pixel, size);
        let altitude_m = (self.camera.altitude_m * factor).clamp(LOWEST_M, HIGHEST_M);
        self.camera = Camera { altitude_m, ..self.camera };
        if let (Some(held), Some(now)) = (held, self.ground_at(pixel, size)) {
            self.carry(now, held);
        }
    }

    /// Flies to a place above the ground point under a pixel, at a quarter of the current height.
    pub fn fly_to_pixel(&mut self, pixel: DVec2, size: [u32; 2]) {
        let Some(ground) = self.ground_at(pixel, size) else { return };
        let over = Camera::from_pose(&Pose { eye: ground, ..self.camera.pose() }, &self.camera);
        let altitude_m = (self.camera.altitude_m / 4.0).max(LOWEST_M);
        self.fly_to(Camera { place: over.place, altitude_m, tilt_deg: 0.0, ..self.camera });
    }
}

/// The border of the ground area that the camera `seen` sees, in pixels of the camera `from`. Both pictures
/// have the same size. `None` where the border misses the ground, or where its ground point is hidden.
pub fn outline(seen: &Camera, from: &Camera, size: [u32; 2]) -> Vec<Option<DVec2>> {
    const STEPS: u32 = 32;
    let (theirs, ours, ground) = (seen.pose(), from.pose(), seen.place.ground());
    let sides = DVec2::from(size.map(f64::from));
    let corners = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y, DVec2::ZERO];
    let to_clip = ours.world_to_clip(size[0].max(1), size[1].max(1));
    let project = |pixel: DVec2| {
        let at = hit(&theirs, ray(&theirs, pixel, size), ground)?;
        let faces_us = ground == Ground::Plane || (ours.eye - at).dot(at) > 0.0;
        let clip = to_clip * (at - ours.eye).extend(0.0);
        (faces_us && clip.w > 0.0).then(|| (clip.truncate().truncate() / clip.w + 1.0) * 0.5 * sides)
    };
    let edge = |ends: &[DVec2]| {
        let (a, b) = (ends[0], ends[1]);
        (0..STEPS).map(move |n| (a + (b - a) * f64::from(n) / f64::from(STEPS)) * sides).collect::<Vec<_>>()
    };
    corners.windows(2).flat_map(edge).chain([DVec2::ZERO]).map(project).collect()
}

/// The unit vector from the camera through a position in the picture.
fn ray(pose: &Pose, pixel: DVec2, size: [u32; 2]) -> DVec3 {
    let size = DVec2::from(size.map(f64::from)).max(DVec2::ONE);
    let tan = (0.5 * pose.vertical_fov_rad).tan();
    let from_middle = (2.0 * pixel - size) / size.y * tan;
    (pose.forward + pose.right * from_middle.x - pose.up * from_middle.y).normalize()
}

fn hit(pose: &Pose, ray: DVec3, ground: Ground) -> Option<DVec3> {
    match ground {
        Ground::Planet => geodesy::ray_to_ellipsoid(pose.eye, ray),
        Ground::Plane => {
            let distance_m = -pose.eye.z / ray.z;
            (distance_m > 0.0 && distance_m.is_finite()).then(|| pose.eye + ray * distance_m)
        }
    }
}

/// The angle, wrapped to -180 ..= 180 degrees.
fn wrapped(degrees: f64) -> f64 {
    degrees - 360.0 * (degrees / 360.0).round()
}

impl Way {
    /// The camera at the current progress: on the great circle between both places (on a plane: on the
    /// line), with the height interpolated logarithmically.
    fn camera(&self) -> Camera {
        let Way { from, to, done } = self;
        if *done >= 1.0 {
            return *to;
        }
        // Smoothstep: starts and ends slowly.
        let share = done * done * (3.0 - 2.0 * done);
        let between = |a: f64, b: f64| a + (b - a) * share;
        let even = |a: f64, b: f64| between(a.ln(), b.ln()).exp();
        Camera {
            place: between_places(&from.place, &to.place, share),
            altitude_m: even(from.altitude_m, to.altitude_m),
            heading_deg: wrapped(from.heading_deg + wrapped(to.heading_deg - from.heading_deg) * share),
            tilt_deg: between(from.tilt_deg, to.tilt_deg),
            vertical_fov_deg: between(from.vertical_fov_deg, to.vertical_fov_deg),
            magnification: even(from.magnification, to.magnification),
            near_m: None,
        }
    }
}

/// The rotation from one direction to another: axis, and angle in radians. glam's function returns the
/// identity for angles below 2e-8 rad, which are 0.1 m on the ground.
fn arc(from: DVec3, to: DVec3) -> (DVec3, f64) {
    let (from, to) = (from.normalize(), to.normalize());
    let cross = from.cross(to);
    (cross.normalize_or(from.any_orthonormal_vector()), cross.length().atan2(from.dot(to)))
}

fn between_places(from: &GroundPoint, to: &GroundPoint, share: f64) -> GroundPoint {
    match (*from, *to) {
        (GroundPoint::Plane { east_m: x0, north_m: y0 }, GroundPoint::Plane { east_m: x1, north_m: y1 }) => {
            GroundPoint::Plane { east_m: x0 + (x1 - x0) * share, north_m: y0 + (y1 - y0) * share }
        }
        _ => {
            // Directions are normals of the ellipsoid, so their angles are geodetic latitudes and longitudes.
            let (from, to) = (from.frame().up, to.frame().up);
            let (axis, angle) = arc(from, to);
            let up = DQuat::from_axis_angle(axis, angle * share) * from;
            GroundPoint::Planet {
                latitude_deg: up.z.atan2(up.x.hypot(up.y)).to_degrees(),
                longitude_deg: up.y.atan2(up.x).to_degrees(),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [640, 360];

    fn eye(altitude_m: f64, tilt_deg: f64) -> Eye {
        let place = GroundPoint::Planet { latitude_deg: 46.0, longitude_deg: 8.0 };
        let camera = Camera {
            place,
            altitude_m,
            heading_deg: 30.0,
            tilt_deg,
            vertical_fov_deg: 60.0,
            magnification: 1.0,
            near_m: None,
        };
        Eye::new(camera)
    }

    #[test]
    fn a_dragged_ground_point_follows_the_pointer_at_every_height() {
        for (altitude_m, tilt_deg) in [(1.0, 20.0), (100.0, 20.0), (1e4, 20.0), (1e6, 20.0), (2e7, 5.0)] {
            let mut eye = eye(altitude_m, tilt_deg);
            let (from, to) = (DVec2::new(320.0, 180.0), DVec2::new(330.0, 200.0));
            let held = eye.ground_at(from, SIZE).unwrap();
            eye.drag(from, to, SIZE);
            let now = eye.ground_at(to, SIZE).unwrap();
            // The tolerance is a hundredth of the height: the ellipsoid is not a sphere, and north differs between
            // both points.
            assert!(held.distance(now) < 0.01 * altitude_m, "{altitude_m}: {}", held.distance(now));
            assert!((eye.camera.altitude_m / altitude_m - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn zooming_from_the_highest_to_the_lowest_eye_is_smooth_and_keeps_the_ground_under_the_pointer() {
        let mut eye = eye(HIGHEST_M, 0.0);
        let pixel = DVec2::new(325.0, 175.0);
        while eye.camera.altitude_m > LOWEST_M {
            let before = eye.camera;
            let held = eye.ground_at(pixel, SIZE);
            eye.zoom(0.9, pixel, SIZE);
            let ratio = eye.camera.altitude_m / before.altitude_m;
            assert!((0.9 - 1e-9..1.0).contains(&ratio), "{before:?}");
            if let (Some(held), Some(now)) = (held, eye.ground_at(pixel, SIZE)) {
                assert!(held.distance(now) < 0.02 * eye.camera.altitude_m, "{before:?}");
            }
        }
        assert_eq!(eye.camera.altitude_m, LOWEST_M);
    }

    #[test]
    fn no_flight_leads_below_the_terrain() {
        let place = GroundPoint::Plane { east_m: 0.0, north_m: 0.0 };
        let mut eye = Eye::new(Camera { place, ..eye(3000.0, 80.0).camera });
        eye.fly_to(Camera { altitude_m: 10.0, ..eye.camera });
        while eye.is_under_way() {
            eye.advance(0.05);
            eye.rise_above(2500.0);
            assert!(eye.camera.altitude_m >= 2502.0);
        }
        // The near plane is set from the height above the terrain.
        assert_eq!(eye.camera.pose().near_m, 2.0 / 64.0);
        eye.go(DVec3::new(0.0, 0.0, -1e6));
        eye.rise_above(2500.0);
        assert_eq!((eye.camera.altitude_m, eye.height_m()), (2502.0, 2.0));
    }

    #[test]
    fn flying_over_the_pole_is_as_fast_as_elsewhere() {
        let place = GroundPoint::Planet { latitude_deg: 89.99, longitude_deg: 0.0 };
        let mut eye = Eye::new(Camera { place, heading_deg: 0.0, ..eye(5e3, 45.0).camera });
        for _ in 0..100 {
            let before = eye.camera.pose();
            eye.go(DVec3::new(0.0, 100.0, 0.0));
            let pose = eye.camera.pose();
            let moved = before.eye.distance(pose.eye);
            assert!((moved - 100.0).abs() < 1.0, "{moved} {:?}", eye.camera);
            assert!(before.forward.dot(pose.forward) > 0.999, "{:?}", eye.camera);
        }
    }

    #[test]
    fn turning_keeps_the_middle_of_the_picture_and_never_dives() {
        let mut eye = eye(1e4, 40.0);
        let middle = DVec2::new(320.0, 180.0);
        let held = eye.ground_at(middle, SIZE).unwrap();
        for n in 0..200 {
            eye.turn(DVec2::new(3.0, if n < 100 { -4.0 } else { 7.0 }), SIZE);
            let now = eye.ground_at(middle, SIZE).unwrap();
            assert!(held.distance(now) < 50.0, "{n}: {} {:?}", held.distance(now), eye.camera);
            assert!(eye.camera.altitude_m >= LOWEST_M);
        }
    }

    #[test]
    fn a_camera_sees_its_own_outline_at_the_pictures_edge() {
        let camera = eye(1e4, 20.0).camera;
        let outline = outline(&camera, &camera, SIZE);
        assert_eq!(outline.len(), 129);
        for point in outline {
            let point = point.unwrap();
            let from_edge =
                (point.x.abs().min((point.x - 640.0).abs())).min(point.y.abs().min((point.y - 360.0).abs()));
            assert!(from_edge < 1e-6, "{point}");
        }
        let sky = Camera { tilt_deg: 170.0, ..camera };
        assert!(super::outline(&sky, &camera, SIZE).iter().all(Option::is_none));
    }

    #[test]
    fn a_transition_ends_exactly_at_its_camera() {
        let mut eye = eye(1e7, 0.0);
        let place = GroundPoint::Planet { latitude_deg: -33.0, longitude_deg: -179.0 };
        let to = Camera { place, altitude_m: 300.0, heading_deg: -170.0, tilt_deg: 60.0, ..eye.camera };
        eye.fly_to(to);
        let mut steps = 0;
        while eye.is_under_way() {
            eye.advance(0.02);
            steps += 1;
        }
        assert_eq!((eye.camera, steps), (to, 45));
    }
}
