//! Homogeneous rasterisation (Olano and Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997). A
//! pixel's barycentric coordinates come from the inverse of the 3x3 matrix of the vertices' clip x, y, w. Triangles
//! are not clipped, and vertices are not divided by w. So vertices behind the eye or in the eye's plane need no special
//! case.

use super::orientation::{orientation, orientation_without_ties};
use crate::model::mesh::SourceMesh;
use glam::{DMat4, DVec2, DVec3, DVec4};
use rayon::prelude::*;

/// Derivatives of the texture coordinate by pixel position; x to the right, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derivatives {
    pub dsdx: f64,
    pub dtdx: f64,
    pub dsdy: f64,
    pub dtdy: f64,
}

/// The values of a triangle at a pixel's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Index in the mesh.
    pub triangle: u32,
    pub s: f64,
    pub t: f64,
    /// Differences within the pixel's quad (2 x 2 pixels from even positions), as Vulkan defines dFdxFine and dFdyFine.
    /// The x derivative is the difference between the two centres in the pixel's row, and the y derivative is the
    /// difference between the two centres in its column. The differences use this triangle's plane even if the triangle
    /// does not cover the other centre.
    pub fine: Derivatives,
    /// The exact derivatives at the pixel's centre.
    pub analytic: Derivatives,
    /// Perspective-correct barycentric coordinates, in the order of the triangle's vertices.
    pub weights: [f64; 3],
    /// Distance along the eye's forward axis in metres (clip w).
    pub w_m: f64,
    /// Smallest altitude of the projected triangle, in pixels; infinite if the triangle crosses the eye's plane.
    pub altitude_px: f64,
}

/// Bins of 8 x 8 pixels save time: a pixel tests only its bin's triangles.
const BIN_PX: u32 = 8;
/// Each bin lists the triangles whose bounding boxes, enlarged by this margin, touch it. The margin is needed by
/// [`ReferenceView::candidates`].
pub(super) const MARGIN_PX: f64 = 2.0;

/// A linear function of the position in normalised device coordinates: dot product with `(x, y, 1)`.
type LinearForm = DVec3;

/// A triangle prepared for evaluation at any position in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setup {
    pub triangle: u32,
    /// Clip x, y, w.
    corners: [DVec3; 3],
    /// One for each vertex: the function of the opposite edge, positive inside for either facing. Its value
    /// is the vertex's barycentric coordinate over w, times `scale`.
    pub edges: [LinearForm; 3],
    /// 1 / w, times `scale`.
    pub inverse_w: LinearForm,
    /// Depth (clip z over w), times `scale`.
    depth: LinearForm,
    /// 1 for a triangle that is clockwise in the picture (y down), else -1.
    facing: f64,
    /// Bound of the rounding error of an edge's value, at positions up to 2 (in normalised device coordinates) from the
    /// picture's middle: 2^-46 times the squared length of the longest of `corners`.
    doubt: f64,
    /// |determinant| of the corners: twice the projected area times the product of the three w.
    scale: f64,
    coordinates: [DVec2; 3],
}

/// A mesh prepared for sampling from one eye.
pub struct ReferenceView {
    size: [u32; 2],
    setups: Vec<Setup>,
    bin_columns: u32,
    /// Indices into `setups`, in the mesh's order, each with its box (left, top, right, bottom). The box has the first
    /// and last pixel column and row that the triangle may touch. It has a margin and may extend beyond the picture. A
    /// dense mesh has hundreds of triangles in a bin, of which a pixel needs few.
    bins: Vec<Vec<([i32; 4], u32)>>,
}

/// Every pixel of a picture, row by row from the top; `None` if no triangle covers the centre. The nearest triangle
/// wins; of equally near triangles, the first wins. Triangles are visible from both sides. `world_to_clip` applies to
/// (position - eye).
pub fn rasterise(
    mesh: &SourceMesh,
    world_to_clip: &DMat4,
    eye: DVec3,
    size: [u32; 2],
) -> Vec<Option<Sample>> {
    ReferenceView::new(mesh, world_to_clip, eye, size).samples()
}

impl ReferenceView {
    /// Prepares all triangles. `world_to_clip` applies to (position - eye), clip y points down, depth lies in
    /// 0 ..= 1. `size` is the picture's width and height in pixels.
    pub fn new(mesh: &SourceMesh, world_to_clip: &DMat4, eye: DVec3, size: [u32; 2]) -> ReferenceView {
        assert!(size[0] > 0 && size[1] > 0, "a picture of {size:?} pixels");
        let clip: Vec<DVec4> =
            mesh.positions.iter().map(|&position| *world_to_clip * (position - eye).extend(1.0)).collect();
        let bin_columns = size[0].div_ceil(BIN_PX);
        let bin_rows = size[1].div_ceil(BIN_PX);
        let mut bins = vec![Vec::new(); bin_columns as usize * bin_rows as usize];
        let mut setups = Vec::new();
        for (triangle, vertices) in mesh.triangles.iter().enumerate() {
            let corners = vertices.map(|vertex| clip[vertex as usize]);
            let coordinates = vertices.map(|vertex| mesh.coordinates[vertex as usize]);
            let Some(setup) = Setup::new(triangle as u32, &corners, coordinates) else { continue };
            let Some(reach) = pixel_box(&corners, size) else { continue };
            let bin = |n: usize| reach[n].clamp(0, size[n % 2] as i32 - 1) as u32 / BIN_PX;
            for row in bin(1)..=bin(3) {
                for column in bin(0)..=bin(2) {
                    bins[(row * bin_columns + column) as usize].push((reach, setups.len() as u32));
                }
            }
            setups.push(setup);
        }
        ReferenceView { size, setups, bin_columns, bins }
    }

    /// The picture's width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The visible sample at the centre of one pixel.
    pub fn sample(&self, x: u32, y: u32) -> Option<Sample> {
        assert!(x < self.size[0] && y < self.size[1], "pixel ({x}, {y}) of {:?}", self.size);
        let centre = self.centre(i64::from(x), i64::from(y));
        nearest(self.near([x as i32, y as i32], 0.0), centre).map(|setup| self.sample_of(setup, x, y))
    }

    /// Texture coordinate at any position, in pixels from the picture's upper left corner. Positions up to
    /// [`MARGIN_PX`] beyond the picture use the triangles of the nearest bin at its edge.
    pub fn coordinate(&self, x: f64, y: f64) -> Option<[f64; 2]> {
        let place = self.place([x, y]);
        Some(nearest(self.near([x.floor() as i32, y.floor() as i32], 0.0), place)?.coordinate(place))
    }

    /// A position in normalised device coordinates.
    pub(super) fn place(&self, [x, y]: [f64; 2]) -> DVec3 {
        DVec3::new(2.0 * x / f64::from(self.size[0]) - 1.0, 2.0 * y / f64::from(self.size[1]) - 1.0, 1.0)
    }

    /// Every pixel, row by row from the top.
    pub fn samples(&self) -> Vec<Option<Sample>> {
        let [width, height] = self.size;
        (0..width * height).into_par_iter().map(|pixel| self.sample(pixel % width, pixel / width)).collect()
    }

    /// Triangles that may touch the square of `radius_px` (at most [`MARGIN_PX`]) around a pixel, which lies in the
    /// picture or up to [`MARGIN_PX`] beyond it.
    pub(super) fn near(&self, [x, y]: [i32; 2], radius_px: f64) -> impl Iterator<Item = &Setup> {
        let bin = |at: i32, axis: usize| at.clamp(0, self.size[axis] as i32 - 1) as u32 / BIN_PX;
        let spare = (MARGIN_PX - radius_px) as i32;
        self.bins[(bin(y, 1) * self.bin_columns + bin(x, 0)) as usize]
            .iter()
            .filter(move |([left, top, right, bottom], _)| {
                (left + spare..=right - spare).contains(&x) && (top + spare..=bottom - spare).contains(&y)
            })
            .map(|&(_, setup)| &self.setups[setup as usize])
    }

    /// A pixel's centre in normalised device coordinates. Quads also need pixels beyond the picture's edge.
    pub(super) fn centre(&self, x: i64, y: i64) -> DVec3 {
        let axis = |pixel: i64, side: u32| (2 * pixel + 1) as f64 / f64::from(side) - 1.0;
        DVec3::new(axis(x, self.size[0]), axis(y, self.size[1]), 1.0)
    }

    /// A triangle's values at a pixel, even if it does not cover the centre.
    pub(super) fn sample_of(&self, setup: &Setup, x: u32, y: u32) -> Sample {
        let (x, y) = (i64::from(x), i64::from(y));
        let (left, top) = (x & !1, y & !1);
        let at = |x, y| setup.coordinate_from_first(self.centre(x, y));
        let by_x = at(left + 1, y) - at(left, y);
        let by_y = at(x, top + 1) - at(x, top);
        let centre = self.centre(x, y);
        let coordinate = setup.coordinates[0] + at(x, y);
        Sample {
            triangle: setup.triangle,
            s: coordinate.x,
            t: coordinate.y,
            fine: Derivatives { dsdx: by_x.x, dtdx: by_x.y, dsdy: by_y.x, dtdy: by_y.y },
            analytic: setup.derivatives(centre, self.size),
            weights: setup.edges.map(|edge| edge.dot(centre) / setup.inverse_w.dot(centre)),
            w_m: setup.distance_m(centre),
            altitude_px: setup.altitude_px(self.size),
        }
    }
}

/// The nearest of the triangles that cover a position.
pub(super) fn nearest<'a>(triangles: impl IntoIterator<Item = &'a Setup>, place: DVec3) -> Option<&'a Setup> {
    let mut nearest: Option<(f64, &Setup)> = None;
    for setup in triangles {
        if !setup.misses(place)
            && let Some(inverse_w) = setup.covers(place)
            && nearest.is_none_or(|(nearest, _)| inverse_w > nearest)
        {
            nearest = Some((inverse_w, setup));
        }
    }
    nearest.map(|(_, setup)| setup)
}

impl Setup {
    /// `None` for a triangle seen exactly edge-on or without area.
    fn new(triangle: u32, corners: &[DVec4; 3], coordinates: [DVec2; 3]) -> Option<Setup> {
        let in_picture = corners.map(|corner| DVec3::new(corner.x, corner.y, corner.w));
        let [a, b, c] = in_picture;
        let facing = orientation(a, b, c);
        // Rows of the adjugate matrix.
        let edges = [b.cross(c), c.cross(a), a.cross(b)].map(|edge| edge * facing);
        let scale = a.dot(edges[0]);
        // `scale` is 0 or negative only if the triangle is nearly edge-on and `scale` consists of rounding errors only.
        if facing == 0.0 || scale <= 0.0 || !scale.is_finite() {
            return None;
        }
        let longest = in_picture.map(DVec3::length).into_iter().fold(0.0, f64::max);
        Some(Setup {
            triangle,
            doubt: 2f64.powi(-46) * longest * longest,
            corners: in_picture,
            edges,
            inverse_w: edges[0] + edges[1] + edges[2],
            depth: edges[0] * corners[0].z + edges[1] * corners[1].z + edges[2] * corners[2].z,
            facing,
            scale,
            coordinates,
        })
    }

    /// True if a position is certainly outside, despite rounding; true for most triangles of a bin.
    fn misses(&self, place: DVec3) -> bool {
        self.edges.iter().any(|edge| edge.dot(place) < -self.doubt)
    }

    /// True if all of a convex polygon is certainly outside.
    pub(super) fn misses_all(&self, polygon: &[DVec3]) -> bool {
        self.edges.iter().any(|edge| polygon.iter().all(|corner| edge.dot(*corner) < -self.doubt))
    }

    /// Texture coordinate at a position that the triangle covers.
    pub(super) fn coordinate(&self, place: DVec3) -> [f64; 2] {
        (self.coordinates[0] + self.coordinate_from_first(place)).to_array()
    }

    /// Distance from the eye along its forward axis, in metres, at a position that the triangle covers.
    pub(super) fn distance_m(&self, place: DVec3) -> f64 {
        self.scale / self.inverse_w.dot(place)
    }

    /// 1/w at a position. `None` if the triangle does not cover the position, or if its depth there is not between the
    /// near plane and infinity. Coverage is exact: each position of a closed surface belongs to exactly one of the
    /// adjacent triangles.
    fn covers(&self, place: DVec3) -> Option<f64> {
        let [a, b, c] = self.corners;
        let inside = [(b, c), (c, a), (a, b)]
            .into_iter()
            .all(|(from, to)| orientation_without_ties(from, to, place) * self.facing > 0.0);
        let [inverse_w, depth] = self.inverse_w_and_depth().map(|linear| linear.dot(place));
        (inside && inverse_w > 0.0 && (0.0..=1.0).contains(&depth)).then_some(inverse_w)
    }

    /// 1/w and depth as linear functions, without the common factor.
    pub(super) fn inverse_w_and_depth(&self) -> [LinearForm; 2] {
        [self.inverse_w / self.scale, self.depth / self.scale]
    }

    /// Texture coordinate relative to the first vertex. The value is small, so that differences keep their digits.
    fn coordinate_from_first(&self, place: DVec3) -> DVec2 {
        let [s, t] = self.numerators();
        DVec2::new(s.dot(place), t.dot(place)) / self.inverse_w.dot(place)
    }

    /// (s - s0) / w and (t - t0) / w, times `scale`.
    fn numerators(&self) -> [LinearForm; 2] {
        let [first, second, third] = self.coordinates;
        let (by_second, by_third) = (second - first, third - first);
        [
            self.edges[1] * by_second.x + self.edges[2] * by_third.x,
            self.edges[1] * by_second.y + self.edges[2] * by_third.y,
        ]
    }

    /// Twice the projected area divided by the longest side.
    fn altitude_px(&self, size: [u32; 2]) -> f64 {
        if self.corners.iter().any(|corner| corner.z <= 0.0) {
            return f64::INFINITY;
        }
        let half_px = DVec2::new(f64::from(size[0]), f64::from(size[1])) / 2.0;
        let [a, b, c] = self.corners.map(|corner| corner.truncate() / corner.z * half_px);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        (b - a).perp_dot(c - a).abs() / longest
    }

    /// d(N/D) = (dN D - N dD) / D^2 per pixel: one pixel is 2 / size in device coordinates.
    fn derivatives(&self, place: DVec3, size: [u32; 2]) -> Derivatives {
        let below = self.inverse_w.dot(place);
        let step = [2.0 / f64::from(size[0]), 2.0 / f64::from(size[1])];
        let [s, t] = self.numerators();
        let derivative = |above: LinearForm, axis: usize| {
            (above[axis] * below - above.dot(place) * self.inverse_w[axis]) / (below * below) * step[axis]
        };
        Derivatives {
            dsdx: derivative(s, 0),
            dtdx: derivative(t, 0),
            dsdy: derivative(s, 1),
            dtdy: derivative(t, 1),
        }
    }
}

/// The box of [`ReferenceView::bins`]. `None` if the triangle lies wholly beyond one side of the picture or behind the
/// eye.
fn pixel_box(corners: &[DVec4; 3], size: [u32; 2]) -> Option<[i32; 4]> {
    if corners.iter().all(|corner| corner.w <= 0.0) {
        return None;
    }
    let crosses_the_eyes_plane = corners.iter().any(|corner| corner.w <= 0.0);
    // Half the range, so that sums and differences of limits do not overflow.
    let limits = [i32::MIN / 2, i32::MAX / 2];
    let mut found = [limits[0], limits[0], limits[1], limits[1]];
    for axis in 0..2 {
        let side = f64::from(size[axis]);
        // One pixel more than the margin, so that rejected triangles are outside despite rounding.
        let margin_px = MARGIN_PX + 1.0;
        let reach = 1.0 + 2.0 * margin_px / side;
        // The condition is linear in the corners, so it holds for the whole triangle, even behind the eye.
        let beyond = |sign: f64| corners.iter().all(|corner| sign * corner[axis] > reach * corner.w);
        if beyond(1.0) || beyond(-1.0) {
            return None;
        }
        if crosses_the_eyes_plane {
            // A corner behind the eye projects to the wrong side: search everywhere.
            continue;
        }
        let places = corners.map(|corner| (corner[axis] / corner.w + 1.0) * 0.5 * side);
        let low = places.into_iter().fold(f64::INFINITY, f64::min) - margin_px;
        let high = places.into_iter().fold(f64::NEG_INFINITY, f64::max) + margin_px;
        // Float-to-integer casts saturate.
        found[axis] = (low.floor() as i32).clamp(limits[0], limits[1]);
        found[axis + 2] = (high.ceil() as i32).clamp(limits[0], limits[1]);
    }
    Some(found)
}
