//! What a draw of depth alone can leave out: clusters of the mesh from which no fragment can come.
//!
//! Depth is bit for bit the whole mesh's, so a cluster is left out only where that follows from its bounds:
//! - it lies outside the frustum, with room for the rounding of the device's f32; or
//! - it shows its back, and still does when the device has rounded its vertices and snapped them to a grid of 1/16 pixel,
//!   the coarsest that Vulkan allows. Vertices that move by up to x turn a triangle around only if it can be made flat
//!   by as much, and then it is at most 2 x high. Only clusters that lie wholly in the frustum: of a triangle that is
//!   clipped we do not know the pieces.
//!
//! The draw that shades goes over the whole mesh, as that of the plain texture does with which it is compared.

use crate::model::mesh::{CLUSTER_TRIANGLES, Cluster};
use crate::vk::shader::View;
use glam::{DMat3, DMat4, DVec3, DVec4};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// A software driver takes as long to begin a draw as for the triangles of some clusters: they are drawn where that
/// saves a draw.
const INDICES_OF_A_DRAW: u32 = 8 * 3 * CLUSTER_TRIANGLES as u32;

/// Share of a distance by which the device's place of a vertex may be wrong: some ulps of f32.
const ROUNDING: f64 = 1.0 / (1 << 18) as f64;

/// Share of a world coordinate that the sum of two floats may lack.
const DOUBLE_SINGLE: f64 = 1.0 / (1u64 << 44) as f64;

/// Pixels that snapping may move a vertex by: half a step of 1/16 along both axes.
const SNAPPING_PX: f64 = 1.0 / 16.0;

/// What a camera sees of clusters. From the very numbers that the vertex shader gets.
pub struct Culling {
    eye: DVec3,
    /// Unit normals into the frustum, and distances: left, right, top, bottom, near.
    planes: [DVec4; 5],
    /// Times a place relative to the eye: w.
    depth: DVec3,
    /// Pixels that a metre covers at most at w = 1, across the view and by a change of w alone.
    px: f64,
    /// Pixels squared that a square before the eye covers at w = 1.
    squared_px: f64,
    /// Pixels by which the viewport's transform may be wrong.
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
            px: most_stretch(x_px, y_px) + 0.5 * width.hypot(height) * depth.length(),
            squared_px: DMat3::from_cols(x_px, y_px, depth).determinant(),
            viewport_px: (width + height) / f64::from(1 << 20),
        }
    }

    /// Runs of indices of all clusters that may have fragments, and some more where that makes fewer draws.
    pub fn runs(&self, clusters: &[Cluster]) -> Vec<Range<u32>> {
        let mut runs: Vec<Range<u32>> = Vec::new();
        for cluster in clusters.iter().filter(|cluster| !self.without_fragments(cluster)) {
            let end = cluster.first_index + cluster.count;
            match runs.last_mut() {
                Some(run) if cluster.first_index <= run.end + INDICES_OF_A_DRAW => run.end = end,
                _ => runs.push(cluster.first_index..end),
            }
        }
        runs
    }

    /// Whether no fragment can come of a cluster. Every comparison with what is no number says that some may.
    fn without_fragments(&self, cluster: &Cluster) -> bool {
        let from_eye = cluster.centre - self.eye;
        let doubt_m = self.doubt_m(cluster, from_eye.length());
        let reach_m = cluster.radius_m + doubt_m;
        let deep_m = |plane: &DVec4| plane.dot(from_eye.extend(1.0));
        let outside = self.planes.iter().any(|plane| deep_m(plane) < -reach_m);
        let inside = || self.planes.iter().all(|plane| deep_m(plane) > reach_m);
        outside || inside() && self.shows_its_back(cluster, from_eye, doubt_m)
    }

    /// Metres by which the device may misplace a vertex of a cluster.
    fn doubt_m(&self, cluster: &Cluster, distance_m: f64) -> f64 {
        let world_m = cluster.centre.length() + cluster.radius_m + self.eye.length();
        ROUNDING * (distance_m + cluster.radius_m) + DOUBLE_SINGLE * world_m
    }

    /// Whether each triangle of a cluster in the frustum is a back face, also after rounding and snapping.
    fn shows_its_back(&self, cluster: &Cluster, from_eye: DVec3, doubt_m: f64) -> bool {
        let (distance, radius) = (from_eye.length(), cluster.radius_m);
        let angle = cluster.axis.angle_between(from_eye) + cluster.spread_rad;
        // The planes of the triangles pass the eye at least so far off, all on their inner side.
        let behind_m = distance * angle.cos() - radius;
        let (middle_w, half_w) = (self.depth.dot(from_eye), self.depth.length() * (radius + doubt_m));
        let (least_w, most_w) = (middle_w - half_w, middle_w + half_w);
        if !(angle < FRAC_PI_2 && behind_m > 0.0 && least_w > 0.0) {
            return false;
        }
        // With d / w a vertex's pixels from the middle: d / w - d' / w' = (d - d' - (d' / w') (w - w')) / w, and in the
        // frustum d' / w' is at most half a diagonal of the picture.
        let most_px_of_a_metre = self.px / least_w;
        // Twice a triangle's area in pixels is the determinant of its corners, which is twice its area in the world times
        // its plane's distance from the eye, over their three w; the height is that over the longest side.
        let least_height_px =
            self.squared_px * cluster.least_height_m * behind_m / (most_w.powi(3) * most_px_of_a_metre);
        least_height_px > 2.0 * (SNAPPING_PX + self.viewport_px + most_px_of_a_metre * doubt_m)
    }
}

/// The longest image of a unit vector under the rows `x` and `y`: the greatest singular value.
fn most_stretch(x: DVec3, y: DVec3) -> f64 {
    let (xx, xy, yy) = (x.dot(x), x.dot(y), y.dot(y));
    (0.5 * (xx + yy) + (0.5 * (xx - yy)).hypot(xy)).sqrt()
}
