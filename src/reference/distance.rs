//! Distance between two surfaces, in f64 (P. Cignoni, C. Rocchini and R. Scopigno, "Metro: Measuring Error on
//! Simplified Surfaces", Computer Graphics Forum 1998).
//!
//! Measures the exact distance from points of each surface (evenly spread points and all vertices) to the nearest point
//! of the other surface. Spread points are equally dense by area, so their mean needs no weights. The maximum is a
//! lower bound of the Hausdorff distance, and approaches it as points are added.

use crate::math::splitmix::SplitMix64;
use glam::DVec3;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;

/// A set of triangles.
#[derive(Clone, Copy, Debug)]
pub struct Triangles<'a> {
    pub positions: &'a [DVec3],
    pub faces: &'a [[u32; 3]],
}

/// Distances between two surfaces, in the surfaces' units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distances {
    /// Mean over the spread points of both surfaces.
    pub mean: f64,
    /// Root mean square over the same points.
    pub rms: f64,
    /// The largest distance, vertices included: a lower bound of the Hausdorff distance.
    pub hausdorff: f64,
    /// The largest distance from a point of the first surface to the second surface.
    pub forth: f64,
    /// The largest distance from a point of the second surface to the first surface.
    pub back: f64,
}

/// Distances between two surfaces, measured from `samples` points on each surface and from all vertices. `None` if one
/// of the surfaces has no face with an area.
pub fn compare_surfaces(a: Triangles, b: Triangles, samples: usize, seed: u64) -> Option<Distances> {
    let (tree_a, tree_b) = (tree(a)?, tree(b)?);
    let forth = OneWay::new(a, samples, seed, |p| distance(&tree_b, p));
    let back = OneWay::new(b, samples, seed ^ 0x9e37_79b9, |p| distance(&tree_a, p));
    Some(Distances {
        mean: (forth.mean + back.mean) / 2.0,
        rms: ((forth.mean_square + back.mean_square) / 2.0).sqrt(),
        hausdorff: forth.max.max(back.max),
        forth: forth.max,
        back: back.max,
    })
}

struct OneWay {
    mean: f64,
    mean_square: f64,
    max: f64,
}

impl OneWay {
    fn new(from: Triangles, samples: usize, seed: u64, distance: impl Fn(DVec3) -> f64) -> OneWay {
        let (mut sum, mut sum_of_squares, mut max) = (0.0, 0.0, 0.0_f64);
        let points = spread(from, samples, seed);
        for &point in &points {
            let d = distance(point);
            sum += d;
            sum_of_squares += d * d;
            max = max.max(d);
        }
        for vertex in from.faces.iter().flatten() {
            max = max.max(distance(from.positions[*vertex as usize]));
        }
        let count = points.len().max(1) as f64;
        OneWay { mean: sum / count, mean_square: sum_of_squares / count, max }
    }
}

/// Drops faces without area: their neighbours contain the same nearest points.
fn tree(surface: Triangles) -> Option<TriMesh> {
    let corners = |face: &[u32; 3]| face.map(|vertex| surface.positions[vertex as usize]);
    let has_area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a) != DVec3::ZERO;
    let faces: Vec<[u32; 3]> = surface.faces.iter().copied().filter(|face| has_area(corners(face))).collect();
    let vertices = surface.positions.iter().map(|p| Vector::from_array(p.to_array())).collect();
    TriMesh::new(vertices, faces).ok()
}

fn distance(tree: &TriMesh, point: DVec3) -> f64 {
    let point = Vector::from_array(point.to_array());
    let nearest = tree.project_local_point(point, false).point;
    (nearest - point).length()
}

/// Points spread evenly by area: one in each of `samples` parts of equal area. Empty for a surface without
/// area.
pub fn spread(surface: Triangles, samples: usize, seed: u64) -> Vec<DVec3> {
    let corners = |face: &[u32; 3]| face.map(|vertex| surface.positions[vertex as usize]);
    let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length();
    let whole: f64 = surface.faces.iter().map(|face| area(corners(face))).sum();
    let mut random = SplitMix64(seed);
    let mut unit = || random.unit();
    let mut points = Vec::with_capacity(samples);
    let mut before = 0.0;
    for face in surface.faces {
        let [a, b, c] = corners(face);
        before += area([a, b, c]) / whole;
        // Each part belongs to the face that contains the part's middle, so rounding at a face's end cannot skip a
        // part.
        while points.len() < samples && (points.len() as f64 + 0.5) / (samples as f64) < before {
            let (mut s, mut t) = (unit(), unit());
            if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            points.push(a + (b - a) * s + (c - a) * t);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bumpy square of 2 n^2 faces.
    fn bumps(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let at = |i: u32| f64::from(i) / f64::from(n);
        let height = |x: f64, y: f64| 0.1 * (5.0 * x).sin() * (7.0 * y).cos();
        let point = |i, j| DVec3::new(at(i), at(j), height(at(i), at(j)));
        let id = |i: u32, j: u32| j * (n + 1) + i;
        let square = |(i, j)| {
            let (a, b, c, d) = (id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
            [[a, b, c], [a, c, d]]
        };
        let positions = (0..=n).flat_map(|j| (0..=n).map(move |i| point(i, j))).collect();
        (positions, (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).flat_map(square).collect())
    }

    /// Distance to the nearest triangle by brute force over all faces: to the face's plane if the point projects into
    /// the face, else to the nearest side.
    fn plain_distance(positions: &[DVec3], faces: &[[u32; 3]], p: DVec3) -> f64 {
        let side = |a: DVec3, b: DVec3| {
            let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            (a + (b - a) * along - p).length()
        };
        let to_face = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|vertex| positions[vertex as usize]);
            let normal = (b - a).cross(c - a).normalize();
            let within = |a: DVec3, b: DVec3| normal.dot((b - a).cross(p - a)) >= 0.0;
            let above = within(a, b) && within(b, c) && within(c, a);
            let sides = side(a, b).min(side(b, c)).min(side(c, a));
            if above { normal.dot(p - a).abs() } else { sides }
        };
        faces.iter().map(to_face).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_nearest_point_equals_that_of_a_brute_force_search() {
        let (positions, faces) = bumps(12);
        let surface = Triangles { positions: &positions, faces: &faces };
        let tree = tree(surface).unwrap();
        let mut random = SplitMix64(7);
        let mut unit = || random.unit();
        for _ in 0..500 {
            let p = DVec3::new(unit(), unit(), unit() - 0.5) * 1.5;
            let (found, plain) = (distance(&tree, p), plain_distance(&positions, &faces, p));
            assert!((found - plain).abs() < 1e-12, "{p}: {found} and {plain}");
        }
    }

    #[test]
    fn a_surface_has_distance_zero_to_itself_and_the_offset_to_a_shifted_copy() {
        let (positions, faces) = bumps(12);
        let moved: Vec<DVec3> = positions.iter().map(|p| *p + DVec3::Z * 10.0).collect();
        let flat: Vec<DVec3> = positions.iter().map(|p| p.with_z(0.0)).collect();
        let raised: Vec<DVec3> = positions.iter().map(|p| p.with_z(0.25)).collect();
        let of = |positions| Triangles { positions, faces: &faces };
        let own = compare_surfaces(of(&positions), of(&positions), 1000, 1).unwrap();
        assert!(own.hausdorff < 1e-12, "{own:?}");
        let far = compare_surfaces(of(&positions), of(&moved), 1000, 1).unwrap();
        assert!(far.mean > 9.0 && far.hausdorff < 10.0 + 1e-9, "{far:?}");
        let parallel = compare_surfaces(of(&flat), of(&raised), 1000, 1).unwrap();
        let all = [parallel.mean, parallel.rms, parallel.hausdorff, parallel.forth, parallel.back];
        assert!(all.iter().all(|distance| (distance - 0.25).abs() < 1e-12), "{parallel:?}");
    }

    #[test]
    fn one_displaced_vertex_shows_in_the_largest_distance_and_hardly_in_the_mean() {
        let (positions, faces) = bumps(30);
        let mut wrong = positions.clone();
        wrong[15 * 31 + 15].z += 0.2;
        let of = |positions| Triangles { positions, faces: &faces };
        let found = compare_surfaces(of(&positions), of(&wrong), 10_000, 1).unwrap();
        assert!(found.back > 0.1 && found.hausdorff == found.back.max(found.forth), "{found:?}");
        assert!(found.mean < 0.002 && found.mean > 1e-6 && found.rms > found.mean, "{found:?}");
    }

    #[test]
    fn a_missing_part_is_found_from_one_side_only() {
        let (positions, faces) = bumps(12);
        let whole = Triangles { positions: &positions, faces: &faces };
        let part = Triangles { positions: &positions, faces: &faces[..faces.len() / 2] };
        let found = compare_surfaces(whole, part, 1000, 1).unwrap();
        assert!(found.forth > 0.4 && found.back < 1e-12, "{found:?}");
        assert!(compare_surfaces(whole, Triangles { positions: &positions, faces: &[] }, 10, 1).is_none());
    }

    #[test]
    fn points_are_spread_by_area() {
        let positions = [0.0, 1.0, 4.0].map(|x| DVec3::new(x, 0.0, 0.0)).into_iter();
        let positions: Vec<DVec3> = positions.chain([DVec3::Y]).collect();
        let surface = Triangles { positions: &positions, faces: &[[0, 1, 3], [1, 2, 3]] };
        let points = spread(surface, 400, 3);
        let first = points.iter().filter(|p| p.x + p.y <= 1.0).count();
        assert_eq!((points.len(), first), (400, 100));
    }
}
