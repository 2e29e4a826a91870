//! The place of an instance in the world, whether it is visible, and its wanted deviation (paper 2, section
//! 4; the paper does not say how to choose it).
//!
//! From pixels to object units: a pinhole camera has a focal length of `f = height / (2 tan(fov / 2))` pixels. Such a
//! camera shows a length `e` at distance `d`, perpendicular to the axis in the middle of the picture, as `f e / d`
//! pixels. So `p` pixels are `p d / f` metres at the nearest point of the instance's bounding sphere. Dividing by the
//! instance's scale gives object units. Away from the middle the same length appears longer, by a factor of at most 1 /
//! cos^2 of its angle from the axis. In the corner, this factor is 2.4 for a vertical field of view of 60 degrees at
//! 16:9. The bound holds in the middle and may be exceeded by that factor in the corners.

use super::choices::UpAxis;
use super::config::ProgressiveSurface;
use super::stand::Stand;
use crate::math::camera::Pose;

use glam::{DMat3, DMat4, DVec3};

/// A model's bounding box and sphere around its centre, in object units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    pub half_sides: DVec3,
    /// Distance of the farthest vertex from the centre.
    pub radius: f64,
}

impl Bounds {
    /// The bounds of positions that are relative to the centre of their box.
    pub fn of(positions: &[[f32; 3]]) -> Bounds {
        let far = |so_far: (DVec3, f64), position: &[f32; 3]| {
            let position = DVec3::from(position.map(f64::from));
            (so_far.0.max(position.abs()), so_far.1.max(position.length()))
        };
        let (half_sides, radius) = positions.iter().fold((DVec3::ZERO, 0.0), far);
        Bounds { half_sides, radius }
    }
}

/// The placement of an instance in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Centre of the model's box in world metres.
    pub centre: DVec3,
    /// From object axes to world axes.
    pub rotation: DMat3,
    /// Metres per object unit.
    pub scale: f64,
    /// Radius of the bounding sphere around the centre, in metres.
    pub radius: f64,
}

impl Placement {
    /// The placement of a model with these bounds at `stand`.
    pub fn new(surface: &ProgressiveSurface, bounds: &Bounds, stand: &Stand) -> Placement {
        // A model of a single point has no size: any scale will do.
        let longest = 2.0 * bounds.half_sides.max_element();
        let scale = if longest > 0.0 { surface.size_m / longest } else { 1.0 };
        let (upright, half_height) = match surface.up {
            // x stays east, y becomes up, z points south.
            UpAxis::Y => (DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y), bounds.half_sides.y),
            UpAxis::Z => (DMat3::IDENTITY, bounds.half_sides.z),
        };
        Placement {
            centre: stand.foot + stand.axes.z_axis * (half_height * scale),
            // Clockwise seen from above.
            rotation: stand.axes * DMat3::from_rotation_z(-stand.heading_deg.to_radians()) * upright,
            scale,
            radius: bounds.radius * scale,
        }
    }

    /// From positions relative to the model's centre, in object units, to Vulkan's clip space. The eye is subtracted in
    /// f64; near the eye, the difference is small enough for f32.
    pub fn object_to_clip(&self, pose: &Pose, size: [u32; 2]) -> DMat4 {
        let object_to_eye = DMat4::from_translation(self.centre - pose.eye)
            * DMat4::from_mat3(self.rotation * DMat3::from_diagonal(DVec3::splat(self.scale)));
        pose.world_to_clip(size[0], size[1]) * object_to_eye
    }

    /// Converts a position relative to the model's centre, in object units, to world metres.
    pub fn to_world(&self, position: DVec3) -> DVec3 {
        self.centre + self.rotation * (position * self.scale)
    }

    /// True if the bounding sphere intersects the view frustum. Near the frustum's edges, the result is also true for
    /// some spheres just outside.
    pub fn is_seen(&self, pose: &Pose, size: [u32; 2]) -> bool {
        let to_centre = self.centre - pose.eye;
        let ahead_m = to_centre.dot(pose.forward);
        if ahead_m < pose.near_m - self.radius {
            return false;
        }
        let tan_y = (0.5 * pose.vertical_fov_rad).tan();
        let tan_x = tan_y * f64::from(size[0]) / f64::from(size[1]);
        // The signed distance of the centre to a side plane, positive outside the frustum. The side planes contain the
        // eye.
        let outside = |across_m: f64, tan: f64| (across_m.abs() - tan * ahead_m) / (1.0 + tan * tan).sqrt();
        outside(to_centre.dot(pose.right), tan_x) <= self.radius
            && outside(to_centre.dot(pose.up), tan_y) <= self.radius
    }

    /// The deviation, in object units, that spans `pixels` in a picture with this many rows.
    pub fn wanted_error(&self, pose: &Pose, rows: u32, pixels: f64) -> f64 {
        let focal_px = f64::from(rows) / (2.0 * (0.5 * pose.vertical_fov_rad).tan());
        // If the eye is inside the sphere, the nearest visible point is on the near plane.
        let distance_m = ((self.centre - pose.eye).length() - self.radius).max(pose.near_m);
        pixels * distance_m / focal_px / self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::config;
    use crate::scene::Scene;

    const BOUNDS: Bounds = Bounds { half_sides: DVec3::new(1.0, 2.0, 0.5), radius: 2.2 };

    fn place(foot: DVec3, heading_deg: f64) -> Placement {
        let surface = config::surface(&Scene::embedded("bunny").unwrap(), "bunny").unwrap();
        let surface = ProgressiveSurface { size_m: 8.0, ..surface };
        Placement::new(&surface, &BOUNDS, &Stand::on_plane(foot, heading_deg))
    }

    fn eye(at: DVec3) -> Pose {
        Pose {
            eye: at,
            right: DVec3::X,
            up: DVec3::Z,
            forward: DVec3::Y,
            vertical_fov_rad: std::f64::consts::FRAC_PI_2,
            near_m: 0.1,
            height_m: f64::INFINITY,
        }
    }

    #[test]
    fn the_model_stands_on_its_foot_with_the_given_height() {
        let place = place(DVec3::new(5.0, 6.0, 7.0), 90.0);
        let near = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-12, "{a} {b}");
        near(place.to_world(DVec3::new(0.0, -2.0, 0.0)), DVec3::new(5.0, 6.0, 7.0));
        near(place.to_world(DVec3::new(0.0, 2.0, 0.0)), DVec3::new(5.0, 6.0, 15.0));
        // Without a heading x points east; a quarter turn clockwise makes it point south.
        near(place.to_world(DVec3::new(1.0, -2.0, 0.0)), DVec3::new(5.0, 4.0, 7.0));
    }

    #[test]
    fn the_wanted_error_spans_the_given_pixels_at_the_spheres_nearest_point() {
        let place = place(DVec3::ZERO, 0.0);
        let pose = eye(place.centre - DVec3::Y * (place.radius + 10.0));
        // 90 degrees over 200 rows is a focal length of 100 pixels. 10 m away, a pixel is 0.1 m. At 2 m per unit, this
        // is 0.05 units.
        assert!((place.wanted_error(&pose, 200, 3.0) - 0.15).abs() < 1e-12);
        let at = place.to_world(DVec3::new(0.0, 0.0, place.radius / place.scale));
        assert!((at - pose.eye).length() - 10.0 < 1e-12, "the nearest point");
        let clip = |world: DVec3| pose.world_to_clip(200, 200) * (world - pose.eye).extend(1.0);
        let rows = |world: DVec3| clip(world).y / clip(world).w * 100.0;
        let moved = at + place.rotation * DVec3::new(0.0, 0.15 * place.scale, 0.0);
        assert!((rows(moved) - rows(at)).abs() - 3.0 < 1e-9);
        assert_eq!(place.wanted_error(&eye(place.centre), 200, 1.0), 0.1 / 100.0 / 2.0, "inside the sphere");
    }

    #[test]
    fn a_model_behind_or_beside_the_view_is_not_seen() {
        let place = place(DVec3::ZERO, 0.0);
        let from = |by: DVec3| place.is_seen(&eye(place.centre + by), [100, 100]);
        assert!(from(DVec3::new(0.0, -20.0, 0.0)));
        assert!(from(DVec3::ZERO));
        assert!(!from(DVec3::new(0.0, 20.0, 0.0)), "behind");
        assert!(!from(DVec3::new(30.0, -20.0, 0.0)) && !from(DVec3::new(0.0, -20.0, 30.0)), "beside");
        // The side plane is at 45 degrees. A sphere of radius 4.4 m touches it if the centre is 4.4 sqrt(2) m outside.
        let touch = 20.0 + place.radius * 2f64.sqrt();
        assert!(from(DVec3::new(touch - 1e-6, -20.0, 0.0)) && !from(DVec3::new(touch + 1e-6, -20.0, 0.0)));
    }

    #[test]
    fn the_matrix_agrees_with_to_world() {
        let place = place(DVec3::new(1e6, 2e6, 30.0), 33.0);
        let pose = eye(place.centre + DVec3::new(3.0, -40.0, 1.0));
        let at = DVec3::new(0.3, -0.7, 0.2);
        let through = place.object_to_clip(&pose, [300, 200]) * at.extend(1.0);
        let direct = pose.world_to_clip(300, 200) * (place.to_world(at) - pose.eye).extend(1.0);
        // World coordinates of 1e6 m have a step of 1e-10 m.
        assert!((through - direct).length() < 1e-8, "{through} {direct}");
    }
}
