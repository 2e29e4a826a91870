//! An infinite textured plane in front of a pinhole camera: texture coordinates as a homography of the
//! pixel position.
//!
//! `u = (A x + B y + C) / (G x + H y + I)`, `v = (D x + E y + F) / (G x + H y + I)`, in texels of level 0. x and y are
//! in pixels from the picture's centre, x to the right and y down. The plane is visible where the denominator is
//! positive. As in pictures and in all textures of the project, row 0 of the texture is the upper one: v points down
//! where the plane faces the camera.

/// The orientation of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilt {
    /// Angle between the plane's normal and the view direction; the upper half of the picture is farther
    /// away.
    pub tilt_degrees: f64,
    /// Rotation of the camera about its view direction.
    pub roll_degrees: f64,
    /// Rotation of the texture about the plane's normal.
    pub yaw_degrees: f64,
    /// Texels per pixel along the picture's x axis, at the picture's centre, if roll and yaw are 0.
    pub texels_per_pixel: f64,
    /// Angle from the picture's centre to its upper edge.
    pub half_view_degrees: f64,
}

/// The homography: rows (A B C), (D E F), (G H I).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TiltedPlane(pub [[f64; 3]; 3]);

impl Tilt {
    /// A plane without roll and yaw, with one texel per pixel at the centre. The view spans 16 degrees from the lower
    /// edge to the upper.
    pub const fn of(tilt_degrees: f64) -> Tilt {
        Tilt {
            tilt_degrees,
            roll_degrees: 0.0,
            yaw_degrees: 0.0,
            texels_per_pixel: 1.0,
            half_view_degrees: 8.0,
        }
    }

    /// Distance from the eye to the picture's plane in pixels, for a picture of `height` pixels.
    pub fn focal_px(&self, height: u32) -> f64 {
        f64::from(height) / 2.0 / self.half_view_degrees.to_radians().tan()
    }

    /// The homography for a picture of `height` pixels.
    pub fn plane(&self, height: u32) -> TiltedPlane {
        let focal_px = self.focal_px(height);
        let (sin, cos) = self.tilt_degrees.to_radians().sin_cos();
        let (roll_sin, roll_cos) = self.roll_degrees.to_radians().sin_cos();
        let (yaw_sin, yaw_cos) = self.yaw_degrees.to_radians().sin_cos();
        // A pixel's offset after the roll, (right, up), as linear forms of (x, y, 1).
        let right = [roll_cos, roll_sin, 0.0];
        let up = [roll_sin, -roll_cos, 0.0];
        let form = |a: f64, b: f64, one: f64| [a * right[0] + b * up[0], a * right[1] + b * up[1], one];
        // The origin of the plane's coordinates is the point that is visible at the picture's centre. Their unit is the
        // width of a pixel at that point, and the second one points down. In these coordinates the ray (right, up,
        // focal) meets the plane at (right, -up / cos) * focal cos / (focal cos - up sin).
        let scale = self.texels_per_pixel;
        let denominator = form(0.0, -sin / (focal_px * cos), 1.0);
        let (across, along) = (form(scale, 0.0, 0.0), form(0.0, -scale / cos, 0.0));
        let mixed = |a: f64, b: f64| [0, 1, 2].map(|n| a * across[n] + b * along[n]);
        TiltedPlane([mixed(yaw_cos, -yaw_sin), mixed(yaw_sin, yaw_cos), denominator])
    }
}

impl TiltedPlane {
    /// (u, v) in texels of level 0; `None` beyond the horizon.
    pub fn texels(&self, x: f64, y: f64) -> Option<[f64; 2]> {
        let [u, v, w] = self.0.map(|[a, b, c]| a * x + b * y + c);
        (w > 0.0).then(|| [u / w, v / w])
    }

    /// The rows of the Jacobian, (u_x u_y) and (v_x v_y), in texels per pixel.
    pub fn jacobian(&self, x: f64, y: f64) -> [[f64; 2]; 2] {
        let [u, v, w] = self.0.map(|[a, b, c]| a * x + b * y + c);
        let [numerator_u, numerator_v, denominator] = self.0;
        let row = |numerator: [f64; 3], value: f64| {
            [0, 1].map(|n| (numerator[n] * w - denominator[n] * value) / (w * w))
        };
        [row(numerator_u, u), row(numerator_v, v)]
    }

    /// The plane after the camera moved by this many pixels: the point at (x + dx, y + dy) is now at (x,
    /// y).
    pub fn shifted(&self, [dx, dy]: [f64; 2]) -> TiltedPlane {
        TiltedPlane(self.0.map(|[a, b, c]| [a, b, c + a * dx + b * dy]))
    }

    /// The plane as passed to shaders: every number is rounded to f32.
    pub fn rounded(&self) -> TiltedPlane {
        TiltedPlane(self.0.map(|row| row.map(|number| f64::from(number as f32))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computed geometrically: intersects the pixel's ray with the plane, with yaw and roll as rotations.
    fn by_rays(tilt: &Tilt, height: u32, x: f64, y: f64) -> [f64; 2] {
        let focal = f64::from(height) / 2.0 / tilt.half_view_degrees.to_radians().tan();
        let roll = tilt.roll_degrees.to_radians();
        let (right, up) = (x * roll.cos() + y * roll.sin(), x * roll.sin() - y * roll.cos());
        let t = tilt.tilt_degrees.to_radians();
        // The plane goes through (0, 0, 1); its upward axis leans away from the camera.
        let (axis, normal) = ([0.0, t.cos(), t.sin()], [0.0, -t.sin(), t.cos()]);
        let ray = [right / focal, up / focal, 1.0];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let far = dot([0.0, 0.0, 1.0], normal) / dot(ray, normal);
        let point = ray.map(|c| c * far);
        let from_centre = [point[0], point[1], point[2] - 1.0];
        let scale = tilt.texels_per_pixel * focal;
        let [a, b] = [scale * from_centre[0], scale * dot(from_centre, axis)];
        let yaw = tilt.yaw_degrees.to_radians();
        // The texture turns counter-clockwise, and its rows follow each other downwards.
        [a * yaw.cos() + b * yaw.sin(), a * yaw.sin() - b * yaw.cos()]
    }

    #[test]
    fn without_tilt_the_picture_shows_the_texture_upright() {
        assert_eq!(Tilt::of(0.0).plane(120).texels(7.0, 5.0), Some([7.0, 5.0]));
    }

    #[test]
    fn the_homography_is_the_intersection_of_ray_and_plane() {
        let tilt = Tilt {
            tilt_degrees: 63.0,
            roll_degrees: 20.0,
            yaw_degrees: 35.0,
            texels_per_pixel: 1.5,
            half_view_degrees: 8.0,
        };
        let plane = tilt.plane(120);
        for (x, y) in [(0.0, 0.0), (70.5, -59.5), (-33.25, 41.0)] {
            let (found, expected) = (plane.texels(x, y).unwrap(), by_rays(&tilt, 120, x, y));
            for n in 0..2 {
                assert!((found[n] - expected[n]).abs() < 1e-9, "{found:?}, not {expected:?}");
            }
        }
    }

    #[test]
    fn the_jacobian_is_the_derivative() {
        let plane = Tilt { roll_degrees: 10.0, yaw_degrees: 5.0, ..Tilt::of(75.0) }.plane(120);
        let (x, y, step) = (17.0, -21.0, 1e-5);
        let jacobian = plane.jacobian(x, y);
        for (n, row) in jacobian.into_iter().enumerate() {
            let difference = |dx: f64, dy: f64| {
                (plane.texels(x + dx, y + dy).unwrap()[n] - plane.texels(x - dx, y - dy).unwrap()[n])
                    / (2.0 * step)
            };
            for (found, expected) in row.into_iter().zip([difference(step, 0.0), difference(0.0, step)]) {
                assert!((found - expected).abs() < 1e-6 * expected.abs().max(1.0));
            }
        }
    }

    #[test]
    fn beyond_the_horizon_there_is_no_texture() {
        let plane = Tilt { half_view_degrees: 30.0, ..Tilt::of(80.0) }.plane(120);
        // 10 degrees above the centre, at a focal length of 60 / tan 30.
        let horizon = -60.0 / 30f64.to_radians().tan() * 10f64.to_radians().tan();
        assert!(plane.texels(3.0, horizon + 0.01).is_some());
        assert_eq!(plane.texels(3.0, horizon - 0.01), None);
    }
}
