//! Object-space texturing, filtered in the screen plane (paper 3, step G).
//!
//! Each polygon is rotated parallel to the screen (first about x, then about y). All points of the rotated polygon have
//! one depth and so one level of detail. In this position the polygon is sampled at lattice points, which are called
//! fragments. Each fragment is textured, rotated back, projected, and added to the four surrounding pixels with the
//! weights `(1-fx)(1-fy), fx fy, fx (1-fy), (1-fx) fy`. A pixel's colour is the weighted mean of the fragments added to
//! it. The cost follows the polygons' area in object space.
//!
//! Difference: the thesis locks each pixel for the depth test. Here a first pass finds the nearest plane of each pixel
//! by an atomic maximum of `1 / w`, and a second pass adds the fragments that are not behind this plane. The depth of a
//! fragment is the depth of its polygon's plane at the pixel's centre, so fragments of one polygon cannot hide each
//! other. Sums are integers (weights in units of 1/1024, bytes of colour), so the picture does not depend on the order
//! of the threads.
//!
//! Where a polygon lies behind the projection plane (w >= 1), its projected fragments are at most `spacing` pixels
//! apart. With a spacing of at most 1, every pixel inside the polygon gets a fragment. [`TexturedPolygons::of_plane`]
//! moves a plane behind the projection plane and cuts it off before its horizon, where a pixel would hold too many
//! fragments.

pub mod pass;
pub mod reference;

use super::plane::TiltedPlane;

/// A triangle as shaders read it.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct TexturedTriangle {
    /// In pixels from the picture's centre on the projection plane: x to the right, y down and z towards the eye.
    pub corners: [[f32; 3]; 3],
    /// Texture coordinates of the corners, in texels of level 0.
    pub texels: [[f32; 2]; 3],
}

/// The textured triangles and the camera.
#[derive(Clone, Debug, PartialEq)]
pub struct TexturedPolygons {
    pub triangles: Vec<TexturedTriangle>,
    /// Distance from the eye to the projection plane (the thesis's z_c).
    pub camera_px: f32,
}

/// A plane is cut off where a pixel would hold more fragments than this. 32 bits hold the sum of 1.33 times as many
/// fragments (each with the weight 1024 and the value 255).
pub const MAX_PER_PIXEL: f64 = 12_288.0;

/// The most fragments of a picture; each takes 12 bytes.
pub const MAX_FRAGMENTS: u64 = 1 << 26;

/// Polygons are clipped this many pixels outside the picture, because fragments just outside also contribute to pixels
/// inside it.
const MARGIN_PX: f64 = 2.0;

impl TexturedPolygons {
    /// The part of an infinite plane that is visible in a picture of `size` pixels. This part may be empty. The eye is
    /// `camera_px` from the projection plane; this distance changes the polygons' shape, but not the picture. The plane
    /// is cut off where a pixel would hold more than `max_per_pixel` fragments.
    pub fn of_plane(
        plane: &TiltedPlane,
        size: [u32; 2],
        camera_px: f64,
        spacing: f64,
        max_per_pixel: f64,
    ) -> TexturedPolygons {
        assert!(max_per_pixel <= MAX_PER_PIXEL, "a pixel's sum overflows with {max_per_pixel} fragments");
        let [g, h, i] = plane.0[2];
        let w = |[x, y]: [f64; 2]| g * x + h * y + i;
        let [right, down] = size.map(|side| f64::from(side) / 2.0 + MARGIN_PX);
        let picture = [[-right, -down], [right, -down], [right, down], [-right, down]];
        let max = picture.map(w).into_iter().fold(f64::MIN, f64::max);
        let empty = TexturedPolygons { triangles: Vec::new(), camera_px: camera_px as f32 };
        if max <= 0.0 {
            return empty;
        }
        // Lattice points per pixel where the homography's denominator is w. The plane has been moved back until its
        // nearest point lies on the projection plane.
        let stretch = (g * camera_px).hypot(h * camera_px).hypot(i) / (spacing * spacing);
        let density = |w: f64| max * max * stretch / (w * w * w);
        let mut min = (max * max * stretch / max_per_pixel).cbrt();
        let rows = |min: f64| -> f64 {
            let places = |n: u32, side: u32| f64::from(n) + 0.5 - f64::from(side) / 2.0;
            let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
            let of = pixels.map(|(x, y)| w([places(x, size[0]), places(y, size[1])]));
            of.filter(|w| *w >= min).map(density).sum()
        };
        while rows(min) > 0.5 * MAX_FRAGMENTS as f64 {
            min *= 1.1;
        }
        let seen = clipped(&picture, |at| w(at) - min);
        let corner = |&at: &[f64; 2]| {
            let back = max / w(at);
            let [x, y] = at.map(|c| (c * back) as f32);
            let texels = plane.texels(at[0], at[1]).expect("w is positive");
            ([x, y, (camera_px * (1.0 - back)) as f32], texels.map(|c| c as f32))
        };
        let corners: Vec<_> = seen.iter().map(corner).collect();
        let fan = corners.windows(2).skip(1).map(|pair| {
            let three = [corners[0], pair[0], pair[1]];
            TexturedTriangle {
                corners: three.map(|(corner, _)| corner),
                texels: three.map(|(_, texels)| texels),
            }
        });
        TexturedPolygons { triangles: fan.collect(), ..empty }
    }

    /// Upper bound of the number of fragments. A convex polygon contains at most area + perimeter / 2 + 1 lattice
    /// points. The factor 0.54 and the summand 4 also cover triangles whose edges are moved out by 1/64 of a step.
    pub fn max_fragments(&self, spacing: f64) -> u64 {
        let of = |triangle: &TexturedTriangle| {
            let [area, perimeter, _] = extent(triangle, spacing);
            (area + 0.54 * perimeter + 4.0) as u64
        };
        self.triangles.iter().map(of).sum()
    }

    /// Rows of lattice points of the largest triangle.
    fn max_rows(&self, spacing: f64) -> u32 {
        let of = |triangle: &TexturedTriangle| extent(triangle, spacing)[2] as u32 + 3;
        self.triangles.iter().map(of).max().unwrap_or(0)
    }

    /// Area of all triangles, in pixels of the projection plane.
    pub fn area(&self) -> f64 {
        self.triangles.iter().map(|triangle| extent(triangle, 1.0)[0]).sum()
    }
}

/// Area, perimeter and longest side of a triangle, in steps of the lattice.
fn extent(triangle: &TexturedTriangle, spacing: f64) -> [f64; 3] {
    let side = |n: usize| {
        let [a, b] = [triangle.corners[n], triangle.corners[(n + 1) % 3]];
        [0, 1, 2].map(|c| f64::from(b[c]) - f64::from(a[c]))
    };
    let length = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z) / spacing;
    let ([ax, ay, az], [bx, by, bz]) = (side(0), side(1));
    let across = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
    let sides = [0, 1, 2].map(|n| length(side(n)));
    [length(across) / (2.0 * spacing), sides.iter().sum(), sides.into_iter().fold(0.0, f64::max)]
}

/// The part of a convex polygon where a linear function is at least 0 (I. Sutherland, G. Hodgman, "Reentrant polygon
/// clipping", 1974).
fn clipped(corners: &[[f64; 2]], inside: impl Fn([f64; 2]) -> f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::new();
    for (n, &a) in corners.iter().enumerate() {
        let b = corners[(n + 1) % corners.len()];
        let (at_a, at_b) = (inside(a), inside(b));
        if at_a >= 0.0 {
            kept.push(a);
        }
        if (at_a >= 0.0) != (at_b >= 0.0) {
            let part = at_a / (at_a - at_b);
            kept.push([0, 1].map(|c| a[c] + part * (b[c] - a[c])));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::texture_mapping::plane::Tilt;

    /// The area, and so the number of fragments, grows with the tilt.
    #[test]
    fn a_planes_area_is_that_of_its_part_in_the_picture() {
        let camera = Tilt::of(0.0).focal_px(72);
        let of = |tilt: f64| {
            TexturedPolygons::of_plane(&Tilt::of(tilt).plane(72), [96, 72], camera, 1.0, MAX_PER_PIXEL).area()
        };
        assert!((of(0.0) - 100.0 * 76.0).abs() < 1e-3, "{}", of(0.0));
        // Integrates the surface element (g f, h f, i) / w^3 on a grid over the picture with its margin.
        let plane = Tilt::of(70.0).plane(72);
        let [g, h, i] = plane.0[2];
        let max = g.abs() * 50.0 + h.abs() * 38.0 + i;
        let mut sum = 0.0;
        for (x, y) in (0..760).flat_map(|y| (0..1000).map(move |x| (x, y))) {
            let w = g * (f64::from(x) / 10.0 - 49.95) + h * (f64::from(y) / 10.0 - 37.95) + i;
            sum += max * max * (g * camera).hypot(h * camera).hypot(i) / w.powi(3) / 100.0;
        }
        assert!((of(70.0) / sum - 1.0).abs() < 1e-3, "{} {sum}", of(70.0));
    }

    #[test]
    fn before_its_horizon_a_plane_ends_within_its_budget() {
        for tilt in [85.0, 89.0, 89.999] {
            let plane = Tilt { half_view_degrees: 20.0, ..Tilt::of(tilt) };
            let polygons = TexturedPolygons::of_plane(
                &plane.plane(72),
                [96, 72],
                plane.focal_px(72),
                0.5,
                MAX_PER_PIXEL,
            );
            let max = polygons.max_fragments(0.5);
            assert!(max > 0 && max <= MAX_FRAGMENTS, "{tilt}: {max}");
        }
    }
}
