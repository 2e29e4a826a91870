//! Cleaning: converts the mesh of a file to a [`Model`] and counts every change.
//!
//! Invalid vertices are removed with their faces; equal positions are welded; degenerate and duplicate faces are
//! dropped; the rest is made manifold. Holes stay open: closing them would be a guess.

use super::attributes::{finite_coordinates, first_alike, usable_normals};
use super::manifold::Faces;
use super::outliers::usable;
use super::raw::{MAX_ITEMS, Raw};
use super::report::MeshReport;
use super::{Attributes, Model};
use glam::DVec3;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// A face is flat if twice its area over the square of its sides' largest extent along an axis is at most this, the
/// rounding error of collinear points in f64.
const FLAT: f64 = 1.0 / (1u64 << 48) as f64;
/// Makes a model from a mesh. Positions and remaining faces keep their order. The wedges of a position are adjacent, in
/// the order in which faces use them. The model may have no faces.
///
/// # Panics
/// If an index is out of range, a list of attributes has a wrong length, or there are more than 2^27 vertices or faces
/// (readers refuse such files).
pub fn clean(raw: &Raw) -> (Model, MeshReport) {
    let vertices = raw.positions.len();
    assert!(
        vertices <= MAX_ITEMS && raw.faces.len() <= MAX_ITEMS,
        "{vertices} vertices, {} faces",
        raw.faces.len()
    );
    let Attributes { normals, coordinates, colors } = &raw.attributes;
    for length in [normals.len(), coordinates.len(), colors.len()] {
        assert!(length == 0 || length == vertices, "{length} attributes for {vertices} vertices");
    }
    let mut report = MeshReport { vertices, file_faces: raw.faces.len(), ..MeshReport::default() };
    let usable = usable(raw, &mut report);
    let (points, mut positions) = weld(&raw.positions, &usable, &mut report);
    let (mut faces, doubled) = sift(raw, &usable, &points, &mut report);
    report.folded_faces = faces.unfold(&doubled);
    let thin: Vec<bool> = faces.points.iter().map(|&face| is_thin(&positions, face)).collect();
    report.thin_faces = faces.thin(&thin);
    report.zero_area_faces = faces.points.iter().filter(|&&face| is_flat(&positions, face)).count();
    report.turned_faces = faces.orient();
    [report.non_manifold_edges, report.split_positions] = faces.cut(&mut positions);
    let model = assemble(raw, &faces, &positions, &points, &mut report);
    report.count(&model);
    (model, report)
}

/// The point of each vertex, and the position of each point. Points are in the order of their first vertices.
fn weld(positions: &[DVec3], usable: &[bool], report: &mut MeshReport) -> (Vec<u32>, Vec<DVec3>) {
    let mut known: HashMap<[u64; 3], u32> = HashMap::with_capacity(positions.len());
    let mut points = Vec::new();
    let mut point_of = |(&position, &fits): (&DVec3, &bool)| {
        if !fits {
            return u32::MAX;
        }
        // -0 + 0 is +0.
        let position = position + DVec3::ZERO;
        *known.entry(position.to_array().map(f64::to_bits)).or_insert_with(|| {
            points.push(position);
            points.len() as u32 - 1
        })
    };
    let point_of_vertex: Vec<u32> = positions.iter().zip(usable).map(&mut point_of).collect();
    report.welded_vertices = usable.iter().filter(|fits| **fits).count() - points.len();
    (point_of_vertex, points)
}

/// Drops degenerate and duplicate faces. Returns the remaining faces. Also returns, for each remaining face, true if
/// the file has equally many copies of it in both windings; the face itself counts as a copy.
fn sift(raw: &Raw, usable: &[bool], points: &[u32], report: &mut MeshReport) -> (Faces, Vec<bool>) {
    // Keyed by the three points, smallest first: index of the kept face, its winding, copies minus reversed copies.
    let mut seen: HashMap<[u32; 3], (usize, bool, i32)> = HashMap::with_capacity(raw.faces.len());
    let mut faces = Faces::default();
    for face in &raw.faces {
        let corners @ [a, b, c] = face.map(|vertex| points[vertex as usize]);
        if face.iter().any(|&vertex| !usable[vertex as usize]) {
            report.faces_set_aside += 1;
        } else if face[0] == face[1] || face[1] == face[2] || face[2] == face[0] {
            report.index_degenerate_faces += 1;
        } else if a == b || b == c || c == a {
            report.collapsed_faces += 1;
        } else {
            let [first, second, third] = turned(corners);
            let winding = second < third;
            match seen.entry([first, second.min(third), second.max(third)]) {
                Entry::Vacant(entry) => {
                    entry.insert((faces.vertices.len(), winding, 1));
                    faces.vertices.push(*face);
                    faces.points.push(corners);
                }
                Entry::Occupied(mut entry) if entry.get().1 == winding => {
                    entry.get_mut().2 += 1;
                    report.duplicate_faces += 1;
                }
                Entry::Occupied(mut entry) => {
                    entry.get_mut().2 -= 1;
                    report.reversed_faces += 1;
                }
            }
        }
    }
    let mut doubled = vec![false; faces.vertices.len()];
    seen.values().filter(|(_, _, balance)| *balance == 0).for_each(|&(face, _, _)| doubled[face] = true);
    (faces, doubled)
}

/// The same face, rotated to start with the smallest index.
fn turned([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Twice a face's area over the square of `longest`, and `longest`: the largest extent of a side along one axis.
fn slenderness(positions: &[DVec3], face: [u32; 3]) -> (f64, f64) {
    let [a, b, c] = face.map(|point| positions[point as usize]);
    let sides = [b - a, c - b, a - c];
    let longest = sides.iter().fold(0f64, |longest, side| longest.max(side.abs().max_element()));
    // Scale to 1 first: the square of 1e-200 is 0, that of 1e200 infinite.
    ((sides[0] / longest).cross(sides[1] / longest).length(), longest)
}

/// True if a face has no area, relative to its size.
fn is_flat(positions: &[DVec3], face: [u32; 3]) -> bool {
    slenderness(positions, face).0 <= FLAT
}

/// True if a face's area can be explained by rounding its corners to f32.
fn is_thin(positions: &[DVec3], face: [u32; 3]) -> bool {
    let max = face.iter().fold(0f64, |max, &point| max.max(positions[point as usize].abs().max_element()));
    let (slender, longest) = slenderness(positions, face);
    slender <= FLAT || slender * longest <= max * f64::from(f32::EPSILON)
}

/// Builds the wedges in use. `points` maps vertices to the points before the cut; `faces.points` holds the positions
/// after it.
fn assemble(raw: &Raw, faces: &Faces, positions: &[DVec3], points: &[u32], report: &mut MeshReport) -> Model {
    let Faces { vertices: kept, points: corners } = faces;
    let mut attributes = raw.attributes.clone();
    report.replaced_attributes =
        usable_normals(&mut attributes, &raw.positions, kept) + finite_coordinates(&mut attributes, kept);
    let alike = first_alike(&attributes, points);
    let key =
        |face: usize, k: usize| u64::from(corners[face][k]) << 32 | u64::from(alike[kept[face][k] as usize]);
    let mut wedges: Vec<(u64, u32)> =
        (0..kept.len() * 3).map(|corner| (key(corner / 3, corner % 3), corner as u32)).collect();
    wedges.sort_unstable();
    wedges.dedup_by_key(|(key, _)| *key);
    // The order depends only on the faces, so that a written model reads back identically.
    let mut order: Vec<u32> = (0..wedges.len() as u32).collect();
    order.sort_unstable_by_key(|&wedge| (wedges[wedge as usize].0 >> 32, wedges[wedge as usize].1));
    let mut model = Model::default();
    let mut last = u64::MAX;
    let mut place = vec![0; wedges.len()];
    for (index, &wedge) in order.iter().enumerate() {
        place[wedge as usize] = index as u32;
        let position = wedges[wedge as usize].0 >> 32;
        if position != last {
            last = position;
            model.positions.push(positions[position as usize]);
        }
        model.wedge_positions.push(model.positions.len() as u32 - 1);
    }
    let vertices: Vec<u32> = order.iter().map(|&wedge| wedges[wedge as usize].0 as u32).collect();
    model.attributes = attributes.select(&vertices);
    let wedge = |face: usize, k: usize| {
        let key = key(face, k);
        place[wedges.partition_point(|(other, _)| *other < key)]
    };
    model.faces = (0..kept.len()).map(|face| std::array::from_fn(|k| wedge(face, k))).collect();
    let mut used = vec![false; raw.positions.len()];
    kept.iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
    let set_aside = report.non_finite_vertices + report.outlying_vertices;
    report.unused_vertices = used.iter().filter(|used| !**used).count() - set_aside;
    model
}

/// Raw meshes for tests.
#[cfg(test)]
pub(super) mod by_hand {
    use super::*;

    pub fn raw(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> Raw {
        let positions = positions.iter().map(|&position| DVec3::from_array(position)).collect();
        Raw { positions, faces: faces.to_vec(), ..Raw::default() }
    }

    pub fn cleaned(raw: &Raw) -> (Model, MeshReport) {
        let (model, report) = clean(raw);
        model.check().unwrap_or_else(|broken| panic!("{broken} in {model:?}"));
        (model, report)
    }

    pub const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
}

#[cfg(test)]
mod tests {
    use super::by_hand::{SQUARE, cleaned, raw};

    #[test]
    fn equal_positions_are_welded_including_0_and_minus_0() {
        let soup = raw(
            &[SQUARE[0], SQUARE[1], SQUARE[2], [-0.0, 0.0, -0.0], SQUARE[2], SQUARE[3]],
            &[[0, 1, 2], [3, 4, 5]],
        );
        let (model, report) = cleaned(&soup);
        assert_eq!((model.positions.len(), report.welded_vertices), (4, 2));
        assert_eq!(model.faces, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(
            (report.topology.edges, report.topology.boundary_edges, report.changes().len()),
            (5, 4, 0)
        );
    }

    #[test]
    fn degenerate_and_duplicate_faces_are_dropped_and_counted() {
        let mut positions = SQUARE.to_vec();
        positions.push(SQUARE[1]);
        let all = raw(&positions, &[[0, 1, 2], [0, 0, 2], [1, 4, 2], [2, 0, 4], [0, 2, 1], [0, 2, 3]]);
        let (model, report) = cleaned(&all);
        assert_eq!(model.faces.len(), 2);
        assert_eq!((report.index_degenerate_faces, report.collapsed_faces), (1, 1));
        assert_eq!((report.duplicate_faces, report.reversed_faces), (1, 1));
    }

    #[test]
    fn a_wedge_for_each_tuple_of_attributes_of_a_position() {
        let mut square =
            raw(&[SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[0], SQUARE[2], SQUARE[3]], &[[0, 1, 2], [3, 4, 5]]);
        square.attributes.normals = vec![[0.0, 0.0, 2.0]; 6];
        assert_eq!(cleaned(&square).0.wedge_positions, [0, 1, 2, 3]);
        square.attributes.normals[3] = [0.0, 3.0, 0.0];
        let (model, report) = cleaned(&square);
        assert_eq!((&model.wedge_positions[..], report.topology.seam_edges), ([0, 0, 1, 2, 3].as_slice(), 1));
        assert_eq!(model.attributes.normals[..2], [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]);
    }

    #[test]
    fn invalid_attributes_are_replaced() {
        let mut square = raw(&SQUARE, &[[0, 1, 2], [0, 2, 3]]);
        square.attributes.normals = vec![[0.0, 0.0, 1.0], [0.0; 3], [f32::NAN, 0.0, 0.0], [0.0, 0.0, 1.0]];
        square.attributes.coordinates = vec![[f32::INFINITY, 0.5], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
        let (model, report) = cleaned(&square);
        assert_eq!(report.replaced_attributes, 3);
        assert_eq!(model.attributes.normals, [[0.0, 0.0, 1.0]; 4]);
        assert_eq!(model.attributes.coordinates[0], [0.0, 0.5]);
    }

    #[test]
    fn flat_faces_are_found_at_any_scale() {
        for scale in [1e-300, 1.0, 1e30] {
            let places = [[0.0; 3], [scale, 0.0, 0.0], [2.0 * scale, 0.0, 0.0], [scale, scale, 0.0]];
            let (model, report) = cleaned(&raw(&places, &[[0, 1, 2], [0, 1, 3]]));
            assert_eq!((report.zero_area_faces, model.faces.len()), (1, 2), "{scale}");
        }
    }
}
