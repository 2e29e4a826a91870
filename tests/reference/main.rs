//! The reference rasteriser, compared with closed forms and with ray tracing.

mod candidates;
mod rays;
mod shapes;

use glam::{DMat4, DVec2, DVec3};
use ortelius::math::camera::Pose;
use ortelius::model::mesh::SourceMesh;
use ortelius::reference::ReferenceView;
use ortelius::scene::camera::{Camera, GroundPoint};

fn camera(place: GroundPoint, altitude_m: f64, tilt_deg: f64) -> Camera {
    Camera {
        place,
        altitude_m,
        heading_deg: 0.0,
        tilt_deg,
        vertical_fov_deg: 60.0,
        magnification: 1.0,
        near_m: None,
    }
}

fn over_plane(east_m: f64, north_m: f64, altitude_m: f64, tilt_deg: f64) -> Pose {
    camera(GroundPoint::Plane { east_m, north_m }, altitude_m, tilt_deg).pose()
}

fn over_earth(latitude_deg: f64, longitude_deg: f64, altitude_m: f64, tilt_deg: f64) -> Pose {
    camera(GroundPoint::Planet { latitude_deg, longitude_deg }, altitude_m, tilt_deg).pose()
}

fn view(mesh: &SourceMesh, pose: &Pose, size: [u32; 2]) -> ReferenceView {
    ReferenceView::new(mesh, &pose.world_to_clip(size[0], size[1]), pose.eye, size)
}

/// The direction of the ray through a point of the picture (in pixels), from the pinhole's geometry.
fn ray(pose: &Pose, size: [u32; 2], x_px: f64, y_px: f64) -> DVec3 {
    let [width, height] = size.map(f64::from);
    let pixel = 2.0 * (0.5 * pose.vertical_fov_rad).tan() / height;
    pose.forward + pose.right * ((x_px - width / 2.0) * pixel) - pose.up * ((y_px - height / 2.0) * pixel)
}

/// (s, t) of a plane of the given sides where the ray meets it, covered or not.
fn on_plane(pose: &Pose, size: [u32; 2], sides_m: [f64; 2], x_px: f64, y_px: f64) -> DVec2 {
    let direction = ray(pose, size, x_px, y_px);
    let point = pose.eye - direction * (pose.eye.z / direction.z);
    DVec2::new(point.x / sides_m[0] + 0.5, 0.5 - point.y / sides_m[1])
}

/// One metre is one pixel; the plane's origin is in the picture's middle.
fn straight_on(size: [u32; 2]) -> (DMat4, DVec3) {
    let pose = Pose {
        eye: DVec3::new(0.0, 0.0, f64::from(size[1])),
        right: DVec3::X,
        up: DVec3::Y,
        forward: -DVec3::Z,
        vertical_fov_rad: 2.0 * 0.5f64.atan(),
        near_m: 1.0,
        height_m: f64::INFINITY,
    };
    (pose.world_to_clip(size[0], size[1]), pose.eye)
}
