//! Culling for the depth-only draw: leaves out clusters of the mesh that are certainly invisible.
//!
//! The depth image must equal that of the whole mesh, bit for bit. So a cluster is culled only if its bounds prove one
//! of the following:
//! - It lies outside the frustum, by more than the rounding errors of f32; or
//! - It is back-facing, and stays so after the device has rounded its vertices and snapped them to a grid of 1/16
//!   pixel, the coarsest that Vulkan allows. Moving the vertices by up to x flips a triangle only if its height is at
//!   most twice x. Only clusters wholly inside the frustum are tested, because the pieces of a clipped triangle are
//!   unknown.
//!
//! The shading draw covers the whole mesh, as does its baseline, the draw with a plain texture.

use crate::model::mesh::{CLUSTER_TRIANGLES, Cluster};
use crate::vk::shader::View;
use glam::{DMat3, DMat4, DVec3, DVec4};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// On a software driver, starting a draw takes as long as drawing about 8 clusters. So a gap of up to 8 culled clusters
/// is drawn too, which saves a draw.
const INDICES_OF_A_DRAW: u32 = 8 * 3 * CLUSTER_TRIANGLES as u32;

/// Relative error of a vertex position on the device: 32 ulps of f32.
const ROUNDING: f64 = 1.0 / (1 << 18) as f64;

/// Relative error of a world coordinate stored as the sum of two floats.
const DOUBLE_SINGLE: f64 = 1.0 / (1u64 << 44) as f64;

/// Bound of the distance in pixels by which snapping moves a vertex. Half a step of 1/16 along each axis is 0.044.
const SNAPPING_PX: f64 = 1.0 / 16.0;

/// Cluster culling for one camera, computed from the numbers that the vertex shader gets.
pub struct Culling {
    eye: DVec3,
    /// Unit normals into the frustum, and distances: left, right, top, bottom, near.
    planes: [DVec4; 5],
    /// The clip coordinate w is the dot product of this vector and a position relative to the eye.
    depth: DVec3,
    /// Upper bound of the picture's pixels per metre at w = 1, including the change of w along that metre.
    px: f64,
    /// Area in pixels of a unit square that faces the eye at w = 1.
    squared_px: f64,
    /// Error of the viewport transform in pixels.
    viewport_px: f64,
}

impl Culling {
    pub fn new(view: &View, size: [u32; 2]) -> Culling {
        let clip = DMat4::from_cols_array_2d(&view.eye_to_clip.map(|column| column.map(f64::from)));
        let [x, y, z, w] = [0, 1, 2, 3].map(|n| clip.row(n));
        let plane = |row: DVec4| row / row.truncate().length();
        let [width, height] = size.map(f64::from);
        let (x_px, y_px, depth) = (0.5 * width * x.truncate(), 0.5 * height * y.truncate(), w.truncate());
        Culling {
            eye: DVec3::from_array(view.eye_high.map(f64::from))
                + DVec3::from_array(view.eye_low.map(f64::from)),
            planes: [w + x, w - x, w + y, w - y, w - z].map(plane),
            depth,
            px: max_stretch(x_px, y_px) + 0.5 * width.hypot(height) * depth.length(),
            squared_px: DMat3::from_cols(x_px, y_px, depth).determinant(),
            viewport_px: (width + height) / f64::from(1 << 20),
        }
    }

    /// Index ranges of all clusters that are not culled, with small gaps filled to save draws.
    pub fn runs(&self, clusters: &[Cluster]) -> Vec<Range<u32>> {
        let mut runs: Vec<Range<u32>> = Vec::new();
        for cluster in clusters.iter().filter(|cluster| !self.is_invisible(cluster)) {
            let end = cluster.first_index + cluster.count;
            match runs.last_mut() {
                Some(run) if cluster.first_index <= run.end + INDICES_OF_A_DRAW => run.end = end,
                _ => runs.push(cluster.first_index..end),
            }
        }
        runs
    }

    /// True if the cluster is certainly invisible. NaN keeps it.
    fn is_invisible(&self, cluster: &Cluster) -> bool {
        let from_eye = cluster.centre - self.eye;
        let error_m = self.error_m(cluster, from_eye.length());
        let reach_m = cluster.radius_m + error_m;
        let inside_m = |plane: &DVec4| plane.dot(from_eye.extend(1.0));
        let outside = self.planes.iter().any(|plane| inside_m(plane) < -reach_m);
        let inside = || self.planes.iter().all(|plane| inside_m(plane) > reach_m);
        outside || inside() && self.is_back_facing(cluster, from_eye, error_m)
    }

    /// Upper bound of the device's error of a vertex position in the cluster, in metres.
    fn error_m(&self, cluster: &Cluster, distance_m: f64) -> f64 {
        let world_m = cluster.centre.length() + cluster.radius_m + self.eye.length();
        ROUNDING * (distance_m + cluster.radius_m) + DOUBLE_SINGLE * world_m
    }

    /// True if every triangle of a cluster inside the frustum is back-facing, also after rounding and snapping.
    fn is_back_facing(&self, cluster: &Cluster, from_eye: DVec3, error_m: f64) -> bool {
        let (distance, radius) = (from_eye.length(), cluster.radius_m);
        let angle = cluster.axis.angle_between(from_eye) + cluster.spread_rad;
        // The eye is at least this far behind the plane of every triangle.
        let behind_m = distance * angle.cos() - radius;
        let (middle_w, half_w) = (self.depth.dot(from_eye), self.depth.length() * (radius + error_m));
        let (min_w, max_w) = (middle_w - half_w, middle_w + half_w);
        if !(angle < FRAC_PI_2 && behind_m > 0.0 && min_w > 0.0) {
            return false;
        }
        // A vertex lies d / w pixels from the picture's centre. Two vertices differ by
        // d / w - d' / w' = (d - d' - (d' / w') (w - w')) / w. Inside the frustum d' / w' is at most half the diagonal.
        let max_px_of_a_metre = self.px / min_w;
        // Twice a triangle's area in pixels is the determinant of its corners, divided by the product of their w. The
        // determinant is twice its area in the world times the distance of its plane from the eye. Twice the area
        // divided by the longest side is the height.
        let min_height_px =
            self.squared_px * cluster.min_height_m * behind_m / (max_w.powi(3) * max_px_of_a_metre);
        min_height_px > 2.0 * (SNAPPING_PX + self.viewport_px + max_px_of_a_metre * error_m)
    }
}

/// The largest singular value of the matrix with rows `x` and `y`.
fn max_stretch(x: DVec3, y: DVec3) -> f64 {
    let (xx, xy, yy) = (x.dot(x), x.dot(y), y.dot(y));
    (0.5 * (xx + yy) + (0.5 * (xx - yy)).hypot(xy)).sqrt()
}
