//! Data of the full model, before the first collapse: quadrics, special edges, normals and areas.

use super::hub::{EdgeKind, Hub};
use super::quadric::Quadric;
use super::surface::WorkingMesh;
use super::texture::ModelTexture;
use super::wedges::WedgeLists;
use crate::model::Model;
use glam::DVec3;

/// Weight of the planes that hold a border in place, per squared length of the border edge.
const BORDER_WEIGHT: f64 = 10.0;

/// Weight of the planes that hold a seam, per squared length of the seam edge. It is smaller because at a crease the
/// surface's own planes hold it too.
const SEAM_WEIGHT: f64 = 1.0;

/// The quadric of each position, relative to that position. It sums the planes of the faces there, each weighted with a
/// third of the face's area. It also sums planes through each border or seam edge, perpendicular to the edge's faces.
pub fn quadrics(surface: &mut WorkingMesh, hub: &mut Hub, positions: usize) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); positions];
    for face in 0..surface.faces() as u32 {
        let [a, b, c] = surface.triangle(face);
        let normal = (b - a).cross(c - a);
        let double_area = normal.length();
        // A face without area has no plane.
        if double_area > 0.0 {
            for position in surface.face(face) {
                let to_plane = a - surface.point(position);
                let plane = Quadric::plane(normal / double_area, to_plane, double_area / 6.0);
                quadrics[position as usize].add(&plane);
            }
        }
    }
    for position in 0..positions as u32 {
        hub.look(surface, position);
        for edge in hub.edges.iter().filter(|edge| edge.kind != EdgeKind::Plain) {
            let weight = if edge.kind == EdgeKind::Seam { SEAM_WEIGHT } else { BORDER_WEIGHT };
            let along = surface.point(edge.end) - surface.point(position);
            for corner in hub.corners.iter().filter(|x| x.a == edge.end || x.b == edge.end) {
                let [a, b, c] = surface.triangle(corner.face);
                let across = (b - a).cross(c - a).cross(along).normalize_or_zero();
                let plane = Quadric::plane(across, DVec3::ZERO, weight * along.length_squared());
                quadrics[position as usize].add(&plane);
            }
        }
    }
    quadrics
}

/// Edges of the model with a role of their own.
#[derive(Default)]
pub struct SpecialEdges {
    /// Every border edge, from both ends.
    pub borders: Vec<[u32; 2]>,
    /// Points on folds and on long edges, each with one of the faces there. The farthest points are often there, not at
    /// the ends.
    pub points: Vec<(u32, DVec3)>,
}

/// Cosine of the smallest angle between the normals at a fold: 100 degrees. With 45 degrees, the mean distances of the
/// bunny and of `dragon_res4` are up to 5 % larger at a twentieth of the faces.
const FOLD_COSINE: f64 = -0.17;

/// Longest part of an edge between two of its points, relative to the mean length of an edge. On scans fewer than one
/// edge in a hundred are longer.
const LONGEST_PART: f64 = 2.0;

impl SpecialEdges {
    /// `normals` are those of the faces.
    pub fn of(surface: &mut WorkingMesh, hub: &mut Hub, positions: usize, normals: &[DVec3]) -> SpecialEdges {
        let mut found = SpecialEdges::default();
        let longest = LONGEST_PART * mean_side(surface);
        for position in 0..positions as u32 {
            hub.look(surface, position);
            for edge in &hub.edges {
                if edge.kind == EdgeKind::Border {
                    found.borders.push([position, edge.end]);
                } else if edge.end > position {
                    let corners = hub.corners.iter().filter(|x| x.a == edge.end || x.b == edge.end);
                    let mut faces = corners.map(|corner| corner.face);
                    let (Some(one), Some(other)) = (faces.next(), faces.next()) else { continue };
                    let cosine = normals[one as usize].dot(normals[other as usize]);
                    let is_fold = cosine < FOLD_COSINE || faces.next().is_some();
                    let [from, to] = [position, edge.end].map(|end| surface.point(end));
                    let parts =
                        (from.distance(to) / longest).ceil().max(if is_fold { 2.0 } else { 1.0 }) as u32;
                    let point = |part| from.lerp(to, f64::from(part) / f64::from(parts));
                    found.points.extend((1..parts).map(|part| (one, point(part))));
                }
            }
        }
        found
    }
}

/// The mean length of the sides of all faces.
fn mean_side(surface: &WorkingMesh) -> f64 {
    let sides = (0..surface.faces() as u32).flat_map(|face| {
        let [a, b, c] = surface.triangle(face);
        [a.distance(b), b.distance(c), c.distance(a)]
    });
    sides.sum::<f64>() / (3 * surface.faces()) as f64
}

/// Unit normals of all faces; zero for degenerate faces.
pub fn normals(surface: &WorkingMesh) -> Vec<DVec3> {
    let normal = |face| {
        let [a, b, c] = surface.triangle(face);
        (b - a).cross(c - a).normalize_or_zero()
    };
    (0..surface.faces() as u32).map(normal).collect()
}

/// The model's normals and texture coordinates, and the area that each position represents.
pub struct ShadingAttributes {
    /// Unit normal of each of the model's wedges: the model's own, or else the area-weighted mean over the faces
    /// at the position.
    pub normals: Vec<DVec3>,
    /// A third of the area of each position's faces in the model.
    pub areas: Vec<f64>,
    /// Set if the model has texture coordinates.
    pub texture: Option<ModelTexture>,
}

impl ShadingAttributes {
    /// `surface` has all of the model's faces.
    pub fn of(
        model: &Model,
        surface: &WorkingMesh,
        lists: &WedgeLists,
        positions: usize,
    ) -> ShadingAttributes {
        let (mut sums, mut areas) = (vec![DVec3::ZERO; positions], vec![0.0; positions]);
        for face in 0..surface.faces() as u32 {
            let [a, b, c] = surface.triangle(face);
            let twice_area = (b - a).cross(c - a);
            for position in surface.face(face) {
                sums[position as usize] += twice_area;
                areas[position as usize] += twice_area.length() / 6.0;
            }
        }
        let own = |normal: &[f32; 3]| DVec3::from(normal.map(f64::from)).normalize_or(DVec3::Z);
        let mut normals: Vec<DVec3> = model.attributes.normals.iter().map(own).collect();
        if normals.is_empty() {
            normals = vec![DVec3::Z; model.wedge_positions.len()];
            for face in 0..surface.faces() as u32 {
                for (corner, position) in (0..).zip(surface.face(face)) {
                    normals[surface.wedge(face, corner) as usize] =
                        sums[position as usize].normalize_or(DVec3::Z);
                }
            }
        }
        ShadingAttributes { normals, areas, texture: ModelTexture::of(model, surface, lists) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::curve::Curve;
    use super::*;
    use crate::model::named;

    #[test]
    fn a_low_tetrahedron_without_a_side_has_two_folds_and_three_border_edges() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.3, 0.3, 0.1)];
        let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2]];
        let model = Model { positions, wedge_positions: (0..4).collect(), faces, ..Model::default() };
        let (mut surface, _) = WorkingMesh::new(&model, &Curve::of(&model));
        let normals = normals(&surface);
        let found = SpecialEdges::of(&mut surface, &mut Hub::new(4), 4, &normals);
        assert_eq!((found.borders.len(), found.points.len()), (6, 2));
        assert!(found.borders.iter().all(|&[a, b]| found.borders.contains(&[b, a])));
        for (face, middle) in found.points {
            let corners = surface.triangle(face);
            let sides = [[0, 1], [1, 2], [2, 0]].map(|side| side.map(|corner| corners[corner]));
            assert!(sides.iter().any(|[a, b]| (*a + *b) / 2.0 == middle), "{face}: {middle}");
        }
    }

    #[test]
    fn the_parts_of_a_long_edge_are_at_most_twice_as_long_as_the_mean_edge() {
        let mut model = named("grid:9").unwrap();
        for point in &mut model.positions {
            point.x += if point.x > 0.4 { 3.0 } else { 0.0 };
        }
        let curve = Curve::of(&model);
        let (mut surface, _) = WorkingMesh::new(&model, &curve);
        let normals = normals(&surface);
        let points = SpecialEdges::of(&mut surface, &mut Hub::new(81), 81, &normals).points;
        let mean = mean_side(&surface);
        assert!(!points.is_empty());
        for row in 0..9 {
            let ends = [9 * row + 7, 9 * row + 8].map(|position| surface.point(curve.places[position]));
            let length = ends[0].distance(ends[1]);
            let on =
                |point: DVec3| (point.distance(ends[0]) + point.distance(ends[1]) - length).abs() < 1e-12;
            let count = points.iter().filter(|(_, point)| on(*point)).count();
            // The first and the last row are borders.
            let wanted = if row % 8 == 0 { 0 } else { (length / (2.0 * mean)).ceil() as usize - 1 };
            assert_eq!(count, wanted, "row {row}");
            assert!(length > 2.0 * mean);
        }
    }
}
