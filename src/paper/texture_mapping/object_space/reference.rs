//! The steps of object-space texturing in f64, with error bounds for f32 and for the integer sums.

use super::{TexturedPolygons, TexturedTriangle};
use crate::paper::texture_mapping::texels::GreyMipmap;

/// The grey value of a pixel: the weighted mean of its fragments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    /// 0 without fragments.
    pub value: f64,
    /// Bound of the rounding error.
    pub slack: f64,
    /// Number of fragments that were added.
    pub fragments: u32,
    /// True if rounding decides whether a fragment exists or is hidden.
    pub undecided: bool,
}

/// What a fragment adds to a pixel.
#[derive(Clone, Copy, Debug)]
struct Part {
    near: f64,
    weight: f64,
    weight_error: f64,
    value: f64,
    value_error: f64,
    /// True if rounding decides whether the fragment is inside its triangle.
    on_edge: bool,
}

/// Relative error of rounding to f32.
const ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// The quantisation step of a weight.
const WEIGHT_STEP: f64 = 1.0 / 1024.0;

/// A plane counts as hidden if its `1 / w` is smaller than the nearest plane's by more than this share.
const BEHIND: f64 = 1.0 / 256.0;

/// Distance, in steps of the lattice, up to which a fragment outside an edge still belongs to the triangle.
const EDGE_MARGIN: f64 = 1.0 / 64.0;

/// Bound of the relative error of a plane's `1 / w`.
const NEAR_ERROR: f64 = 1e-4;

type Vec3 = [f64; 3];

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn minus(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|c| a[c] - b[c])
}

/// A triangle's rotation: the rows of the matrix that turns its normal to +z.
fn rotation([nx, ny, nz]: Vec3) -> [Vec3; 3] {
    let d = ny.hypot(nz);
    let (cos, sin) = if d > 0.0 { (nz / d, ny / d) } else { (1.0, 0.0) };
    [[d, -sin * nx, -cos * nx], [0.0, cos, -sin], [nx, ny, nz]]
}

/// A pixel's state between the two passes: its sums and its nearest planes.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// The largest 1 / w of three sets: the fragments that certainly count, all fragments as computed, and the
    /// fragments that may count.
    certain: f64,
    near: f64,
    possible: f64,
    weights: f64,
    values: f64,
    weight_errors: f64,
    value_error: f64,
    fragments: u32,
    undecided: bool,
}

/// Every pixel, row by row.
pub fn picture(polygons: &TexturedPolygons, spacing: f64, size: [u32; 2], texels: &GreyMipmap) -> Vec<Mean> {
    let mut pixels = vec![Sums::default(); (size[0] * size[1]) as usize];
    let camera = f64::from(polygons.camera_px);
    let triangles = || polygons.triangles.iter().filter_map(|one| RotatedTriangle::of(one, camera, spacing));
    triangles().for_each(|own| splat(&own, size, texels, |at, part| pixels[at].hide(part)));
    triangles().for_each(|own| splat(&own, size, texels, |at, part| pixels[at].add(part)));
    pixels.iter().map(Sums::mean).collect()
}

impl Sums {
    /// The depth test.
    fn hide(&mut self, part: &Part) {
        let raise = |near: &mut f64, weight: f64| {
            if weight >= 0.5 * WEIGHT_STEP {
                *near = near.max(part.near);
            }
        };
        raise(&mut self.certain, if part.on_edge { 0.0 } else { part.weight - part.weight_error });
        raise(&mut self.near, part.weight);
        raise(&mut self.possible, part.weight + part.weight_error);
    }

    fn add(&mut self, part: &Part) {
        let behind = self.near * (1.0 - BEHIND);
        self.undecided |= part.on_edge || (part.near - behind).abs() < NEAR_ERROR * self.near;
        if part.near < behind {
            return;
        }
        self.weights += part.weight;
        self.values += part.weight * part.value;
        // The weight itself is rounded to a multiple of `WEIGHT_STEP`.
        self.weight_errors += part.weight_error + 0.5 * WEIGHT_STEP;
        self.value_error = self.value_error.max(part.value_error);
        self.fragments += u32::from(part.weight >= 0.5 * WEIGHT_STEP);
    }

    fn mean(&self) -> Mean {
        let undecided = self.undecided || self.possible - self.certain > NEAR_ERROR * self.near;
        if self.fragments == 0 {
            return Mean { undecided, ..Mean::default() };
        }
        // Values from 0 to 1 differ from their mean by at most 1, so errors of the weights shift the mean by at most
        // the sum of these errors divided by the sum of the weights.
        let by_weights = self.weight_errors / (self.weights - self.weight_errors).max(0.0);
        Mean {
            value: self.values / self.weights,
            slack: by_weights + self.value_error + 4.0 * ROUNDING,
            fragments: self.fragments,
            undecided,
        }
    }
}

/// A triangle parallel to the screen.
struct RotatedTriangle<'a> {
    triangle: &'a TexturedTriangle,
    /// Rows of the rotation matrix; the last row is the normal.
    turn: [Vec3; 3],
    camera: f64,
    spacing: f64,
    z: f64,
    /// Corners in steps of the lattice, and twice their signed area.
    at: [[f64; 2]; 3],
    area: f64,
    /// Least and largest 1 / w of the corners.
    range: [f64; 2],
    /// Longest side squared over twice the area: scales the effect of rounding on the normal.
    shape: f64,
    /// Error of a rotated coordinate in f32, in pixels.
    place_error: f64,
}

impl RotatedTriangle<'_> {
    /// `None` if the triangle has no area or is not wholly in front of the eye.
    fn of(triangle: &TexturedTriangle, camera: f64, spacing: f64) -> Option<RotatedTriangle<'_>> {
        let corners = triangle.corners.map(|corner| corner.map(f64::from));
        let [ab, ac] = [minus(corners[1], corners[0]), minus(corners[2], corners[0])];
        let across = cross(ab, ac);
        let doubled_area = dot(across, across).sqrt();
        let w = corners.map(|corner| 1.0 - corner[2] / camera);
        if doubled_area == 0.0 || w.iter().any(|w| *w <= 0.0) {
            return None;
        }
        let turn = rotation(across.map(|c| c / doubled_area));
        let at = corners.map(|corner| [0, 1].map(|row| dot(turn[row], corner) / spacing));
        let longest = [ab, ac, minus(ac, ab)].map(|side| dot(side, side)).into_iter().fold(0.0, f64::max);
        let farthest = corners.iter().map(|corner| dot(*corner, *corner).sqrt()).fold(0.0, f64::max);
        let shape = longest / doubled_area;
        Some(RotatedTriangle {
            triangle,
            turn,
            camera,
            spacing,
            z: dot(turn[2], corners[0]),
            at,
            area: (at[1][0] - at[0][0]) * (at[2][1] - at[0][1])
                - (at[2][0] - at[0][0]) * (at[1][1] - at[0][1]),
            range: w.iter().fold([f64::MAX, 0.0], |[low, high], w| [low.min(1.0 / w), high.max(1.0 / w)]),
            shape,
            place_error: farthest * ROUNDING * 16.0 * (shape + 1.0),
        })
    }

    /// Change of u (`n` = 0) or v (`n` = 1), in texels of level 0, for one lattice step right and for one lattice step
    /// down.
    fn slopes(&self, n: usize) -> [f64; 2] {
        let texels = self.triangle.texels.map(|texels| f64::from(texels[n]));
        let [first, second] = [texels[1] - texels[0], texels[2] - texels[0]];
        let from = |corner: usize, axis: usize| self.at[corner][axis] - self.at[0][axis];
        [
            (first * from(2, 1) - second * from(1, 1)) / self.area,
            (second * from(1, 0) - first * from(2, 0)) / self.area,
        ]
    }

    /// The level whose texel spacing matches the spacing of the fragments, and true if rounding decides between two
    /// levels.
    fn level(&self, coarsest: u32) -> (u32, bool) {
        let [u, v] = [self.slopes(0), self.slopes(1)];
        let wanted = u[0].hypot(v[0]).max(u[1].hypot(v[1])).max(1e-30).log2() + 0.5;
        let undecided = wanted > 0.0 && (wanted - wanted.round()).abs() < 1e-4;
        (wanted.floor().clamp(0.0, f64::from(coarsest)) as u32, undecided)
    }

    /// Columns and rows of the lattice that may hold a fragment.
    fn lattice(&self) -> [std::ops::RangeInclusive<i64>; 2] {
        [0, 1].map(|axis| {
            let of = self.at.map(|corner| corner[axis]);
            let [low, high] = of.iter().fold([f64::MAX, f64::MIN], |[a, b], c| [a.min(*c), b.max(*c)]);
            (low - 1.0).ceil() as i64..=(high + 1.0).floor() as i64
        })
    }

    /// The least signed distance of a lattice position to an edge, positive inside.
    fn inside(&self, i: f64, j: f64) -> f64 {
        let distance = |n: usize| {
            let ([ax, ay], [bx, by]) = (self.at[n], self.at[(n + 1) % 3]);
            let (dx, dy) = (bx - ax, by - ay);
            self.area.signum() * (dx * (j - ay) - dy * (i - ax)) / dx.hypot(dy)
        };
        (0..3).map(distance).fold(f64::MAX, f64::min)
    }

    /// A fragment's value and its rounding error.
    fn textured(&self, i: f64, j: f64, texels: &GreyMipmap, level: u32) -> [f64; 2] {
        let scale = 0.5f64.powi(level as i32);
        let slopes = [self.slopes(0), self.slopes(1)];
        let place = [0, 1].map(|n| {
            let [across, down] = slopes[n];
            let moved = across * (i - self.at[0][0]) + down * (j - self.at[0][1]);
            (f64::from(self.triangle.texels[0][n]) + moved) * scale
        });
        let steep = slopes.iter().flatten().map(|slope| slope.abs()).sum::<f64>() * scale;
        let off = steep * self.place_error / self.spacing * 4.0 * self.shape
            + 8.0 * ROUNDING * (place[0].abs() + place[1].abs() + 1.0);
        // Rounding to a byte adds half a step; values change by at most 1 per texel.
        [bilinear(texels, level, place), 0.5 / 255.0 + off]
    }

    /// A fragment's position on the screen, from the picture's centre, and its rounding error.
    fn projected(&self, i: f64, j: f64) -> ([f64; 2], f64) {
        let rotated = [i * self.spacing, j * self.spacing, self.z];
        let point = [0, 1, 2].map(|c| (0..3).map(|row| self.turn[row][c] * rotated[row]).sum::<f64>());
        let w = 1.0 - point[2] / self.camera;
        let at = [point[0] / w, point[1] / w];
        let off = at[0].abs().max(at[1].abs());
        let error = (2.0 * self.place_error / w) * (1.0 + off / self.camera) + 16.0 * ROUNDING * (off + 1.0);
        (at, error)
    }

    /// 1 / w of the plane at a position on the screen.
    fn near(&self, [x, y]: [f64; 2]) -> f64 {
        let [nx, ny, nz] = self.turn[2];
        let through = self.z - nz * self.camera;
        let near = (nx * x + ny * y - nz * self.camera) / through;
        if through == 0.0 { self.range[1] } else { near.clamp(self.range[0], self.range[1]) }
    }
}

/// Calls `add` for each fragment of a triangle and each pixel that it contributes to.
fn splat(own: &RotatedTriangle<'_>, size: [u32; 2], texels: &GreyMipmap, mut add: impl FnMut(usize, &Part)) {
    let (level, level_undecided) = own.level(texels.coarsest());
    let edge_error = 4.0 * own.place_error / own.spacing + 1e-5;
    let [columns, rows] = own.lattice();
    let half = size.map(|side| f64::from(side) / 2.0);
    for (i, j) in rows.flat_map(|j| columns.clone().map(move |i| (i as f64, j as f64))) {
        let inside = own.inside(i, j) + EDGE_MARGIN;
        if inside < -edge_error {
            continue;
        }
        let [value, value_error] = own.textured(i, j, texels, level);
        let (at, error) = own.projected(i, j);
        let [x, y] = [0, 1].map(|n| at[n] + half[n] - 0.5);
        let around = |at: f64| (at - 1.0).floor() as i64..=(at + 2.0).floor() as i64;
        for (row, column) in around(y).flat_map(|row| around(x).map(move |column| (row, column))) {
            let [dx, dy] = [(x - column as f64).abs(), (y - row as f64).abs()];
            let pixel = [column, row];
            if dx.max(dy) > 1.0 + error || (0..2).any(|n| !(0..i64::from(size[n])).contains(&pixel[n])) {
                continue;
            }
            let part = Part {
                near: own.near([0, 1].map(|n| pixel[n] as f64 + 0.5 - half[n])),
                weight: (1.0 - dx).max(0.0) * (1.0 - dy).max(0.0),
                weight_error: 2.0 * error,
                value,
                value_error,
                on_edge: inside < edge_error || level_undecided,
            };
            add((row * i64::from(size[0]) + column) as usize, &part);
        }
    }
}

/// The bilinear value of a level at a position in texels of this level.
fn bilinear(texels: &GreyMipmap, level: u32, [u, v]: [f64; 2]) -> f64 {
    let ([i, j], [fx, fy]) =
        ([(u - 0.5).floor(), (v - 0.5).floor()], [u - 0.5, v - 0.5].map(|c| c - c.floor()));
    let at = |a: i64, b: i64| f64::from(texels.byte(level, i as i64 + a, j as i64 + b)) / 255.0;
    (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy) + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::pattern::Pattern;

    /// Two triangles of a square of `side` pixels, on the projection plane or behind it, with one texel per pixel.
    fn square(side: f32, z: f32) -> TexturedPolygons {
        let corner = |x: f32, y: f32| ([x * side / 2.0, y * side / 2.0, z], [x * side / 2.0, y * side / 2.0]);
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let triangle = |three: [([f32; 3], [f32; 2]); 3]| TexturedTriangle {
            corners: three.map(|(corner, _)| corner),
            texels: three.map(|(_, texels)| texels),
        };
        TexturedPolygons { triangles: vec![triangle([a, b, c]), triangle([a, c, d])], camera_px: 100.0 }
    }

    #[test]
    fn a_rotated_normal_looks_along_z_and_lengths_stay() {
        for normal in [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.6, 0.0, -0.8], [0.48, 0.6, 0.64]] {
            let turn = rotation(normal);
            let turned = turn.map(|row| dot(row, normal));
            assert!((0..2).all(|n| turned[n].abs() < 1e-12) && (turned[2] - 1.0).abs() < 1e-12, "{turned:?}");
            for n in 0..3 {
                assert!((dot(turn[n], turn[n]) - 1.0).abs() < 1e-12);
                assert!(dot(turn[n], turn[(n + 1) % 3]).abs() < 1e-12);
            }
        }
    }

    /// On the projection plane the lattice is the picture's grid: every pixel is a tent-weighted mean of bilinear
    /// texels.
    #[test]
    fn a_facing_squares_pixel_is_the_mean_of_the_fragments_around_it() {
        let texels = GreyMipmap::new(16, Pattern::WhiteNoise.texels(16));
        let pixels = picture(&square(14.0, 0.0), 1.0, [8, 8], &texels);
        // Fragments lie at the corners of pixels, so each pixel has four. Fragments on the diagonal belong to both
        // triangles.
        for (n, mean) in pixels.iter().enumerate() {
            let [x, y] = [n % 8, n / 8].map(|at| at as f64 - 4.0);
            let around = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
            let weights = around.map(|[a, b]| if x + a == y + b { 2.0 } else { 1.0 });
            let values = around.map(|[a, b]| bilinear(&texels, 0, [x + a, y + b]));
            let sum: f64 = weights.iter().zip(values).map(|(weight, value)| weight * value).sum();
            let value = sum / weights.iter().sum::<f64>();
            assert!((mean.value - value).abs() < 1e-9 && mean.slack < 0.02, "{n}: {mean:?}, not {value}");
        }
    }

    #[test]
    fn what_lies_behind_adds_nothing() {
        let white = GreyMipmap::new(4, vec![255; 16]);
        let mut both = square(20.0, 0.0);
        both.triangles.extend(square(60.0, -40.0).triangles);
        let of = |polygons: &TexturedPolygons| picture(polygons, 1.0, [8, 8], &white);
        let (alone, together) = (of(&square(20.0, 0.0)), of(&both));
        assert!(alone.iter().zip(&together).all(|(a, b)| a.fragments == b.fragments && a.fragments > 0));
    }
}
