//! Texture coordinates: how far a collapse shifts the texture.
//!
//! A face interpolates the texture coordinates of its corners, so a level shows a texel elsewhere than the model. The
//! shift is the distance between these two places. It is measured at points of the new faces, like their distance from
//! the model (`farthest`). The model's place of a texel is found by a walk over the model's faces in the plane of
//! texture coordinates. The walk starts at a corner of the new face and crosses no edge at which the coordinates are
//! discontinuous, so texels of other parts of the model that have the same coordinates are not found. If the walks from
//! several corners find different places, for example where a texture is mirrored, the nearest one counts. J. Cohen,
//! M. Olano and D. Manocha ("Appearance-Preserving Simplification", SIGGRAPH 1998) measure the same shift, where edges of
//! the model and of the level cross in this plane.
//!
//! Where a texture varies in one direction only, the model shows a texel along a line, and the nearest point of the line
//! that a walk finds counts (`isoline`). Faces that show the same texel at all points shift nothing.
//!
//! Left out are texels that no walk finds: those that the model does not show near the face (for example between the
//! triangles of a pole), and those that are too many faces away.
//!
//! Before, the shift was estimated to first order at vanished positions. The largest shift was then 1.44 times the stated
//! error (pm.texture, globe, a quarter of the faces), because it often lies between these positions.

use super::isoline::{Isoline, ToSide};
use super::surface::WorkingMesh;
use super::wedges::WedgeLists;
use crate::model::Model;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Marks a side of a face without a neighbour, or whose neighbour has other coordinates there.
const NONE: u32 = u32::MAX;

/// A walk that needs more faces than this ends without a result.
const MAX_STEPS: usize = 256;

/// A texel belongs to a face if its barycentric coordinates are at least this, so that a texel on an edge belongs to
/// both faces.
const INSIDE: f64 = -1e-9;

/// The model's faces in the plane of texture coordinates.
pub struct ModelTexture {
    /// Texture coordinates of each wedge.
    coordinates: Vec<DVec2>,
    /// Each wedge's point.
    points: Vec<DVec3>,
    /// A face with each wedge, if possible one that has area in the plane.
    starts: Vec<u32>,
    /// Wedges of each face.
    faces: Vec<[u32; 3]>,
    /// True for faces without area in the plane.
    flat: Vec<bool>,
    /// For each face and corner the face across the opposite side, or [`NONE`].
    across: Vec<[u32; 3]>,
}

impl ModelTexture {
    /// `None` without texture coordinates. `surface` has all of the model's faces, and `lists` its wedges.
    pub fn of(model: &Model, surface: &WorkingMesh, lists: &WedgeLists) -> Option<ModelTexture> {
        let own = |st: &[f32; 2]| DVec2::from(st.map(f64::from));
        let coordinates: Vec<DVec2> = model.attributes.coordinates.iter().map(own).collect();
        if coordinates.is_empty() {
            return None;
        }
        let count = coordinates.len();
        let faces: Vec<[u32; 3]> = (0..surface.faces() as u32)
            .map(|face| [0, 1, 2].map(|corner| surface.wedge(face, corner)))
            .collect();
        let mut texture = ModelTexture {
            points: vec![DVec3::ZERO; count],
            starts: vec![NONE; count],
            across: Vec::new(),
            flat: faces
                .iter()
                .map(|wedges| Isoline::is_flat(wedges.map(|wedge| coordinates[wedge as usize])))
                .collect(),
            coordinates,
            faces,
        };
        // Wedges may differ only in other attributes: coordinates are continuous at such a crease.
        let mut same: Vec<u32> = (0..count as u32).collect();
        for position in 0..model.positions.len() as u32 {
            let wedges = lists.of(position);
            for (n, &wedge) in wedges.iter().enumerate() {
                let st = texture.coordinates[wedge as usize];
                let first = wedges[..n].iter().find(|other| texture.coordinates[**other as usize] == st);
                same[wedge as usize] = first.copied().unwrap_or(wedge);
            }
        }
        let mut sides = HashMap::with_capacity(3 * texture.faces.len());
        for face in 0..texture.faces.len() as u32 {
            let wedges = texture.faces[face as usize];
            for (wedge, point) in wedges.map(|wedge| wedge as usize).into_iter().zip(surface.triangle(face)) {
                texture.points[wedge] = point;
                if texture.starts[wedge] == NONE || !texture.flat[face as usize] {
                    texture.starts[wedge] = face;
                }
            }
            for ends in side_ends(wedges.map(|wedge| same[wedge as usize])) {
                sides.insert(ends, face);
            }
        }
        let beyond = |[from, to]: [u32; 2]| sides.get(&[to, from]).copied().unwrap_or(NONE);
        let ends = |wedges: &[u32; 3]| side_ends(wedges.map(|wedge| same[wedge as usize]));
        texture.across = texture.faces.iter().map(|wedges| ends(wedges).map(beyond)).collect();
        Some(texture)
    }

    /// The face where the model shows a texel, and the squared distance from there to the point `shown`, by a walk from
    /// a face. `None` if the walk does not find the texel. Each step crosses the side beyond which the texel lies
    /// farthest, of those with a neighbour where the walk has not been. Along an isoline the walk goes on while it comes
    /// nearer to the point.
    fn walk(&self, start: u32, texel: DVec2, shown: DVec3, been: &mut Vec<u32>) -> Option<(u32, f64)> {
        let mut found = None;
        let mut nearest = f64::INFINITY;
        let mut face = start;
        been.clear();
        loop {
            if been.len() == MAX_STEPS {
                return None;
            }
            been.push(face);
            let (squared, sides) = self.look(face, texel, shown);
            if squared < nearest {
                nearest = squared;
                found = Some((face, squared));
            }
            let sides = sides.into_iter().zip(self.across[face as usize]);
            let new = sides.filter_map(|(side, to)| Some((side?, to)));
            let new = new.filter(|(_, to)| *to != NONE && !been.contains(to));
            let order = |(x, _): &(ToSide, u32), (y, _): &(ToSide, u32)| {
                x.0.total_cmp(&y.0).then(x.1.total_cmp(&y.1))
            };
            let Some((_, next)) = new.min_by(order) else { return found };
            face = next;
        }
    }

    /// The squared distance from where a face shows a texel to the point `shown`, infinite if it does not show the
    /// texel, and the sides beyond which the texel, or a nearer place of it, may be found.
    fn look(&self, face: u32, texel: DVec2, shown: DVec3) -> (f64, [Option<ToSide>; 3]) {
        let wedges = self.faces[face as usize].map(|wedge| wedge as usize);
        let coordinates = wedges.map(|wedge| self.coordinates[wedge]);
        let points = wedges.map(|wedge| self.points[wedge]);
        if self.flat[face as usize] {
            let isoline = Isoline::of(points, coordinates, texel);
            let own = isoline.squared_to(shown);
            return (own, isoline.to_sides(shown, own));
        }
        let [a, b, c] = coordinates;
        let (ab, ac, at) = (b - a, c - a, texel - a);
        let area = ab.perp_dot(ac);
        let (v, w) = (at.perp_dot(ac) / area, ab.perp_dot(at) / area);
        let sides = [1.0 - v - w, v, w].map(|weight| (weight < INSIDE).then_some((weight, 0.0)));
        let [a, b, c] = points;
        let place = a + (b - a) * v + (c - a) * w;
        (if sides == [None; 3] { place.distance_squared(shown) } else { f64::INFINITY }, sides)
    }

    /// The largest squared shift at points of a face with these corners and wedges. Its sides are divided into `parts`;
    /// the corners and the side between the last two are left out, as are texels that no walk finds. Stops early, with a
    /// shift that is too small, once `enough` returns true for it.
    pub fn squared_shift(
        &self,
        [a, b, c]: [DVec3; 3],
        wedges: [u32; 3],
        parts: u32,
        enough: impl Fn(f64) -> bool,
    ) -> f64 {
        let [d, e, f] = wedges.map(|wedge| self.coordinates[wedge as usize]);
        if d == e && e == f {
            return 0.0;
        }
        let corners = wedges.map(|wedge| self.starts[wedge as usize]);
        let part = |count: u32| f64::from(count) / f64::from(parts);
        let mut been = Vec::new();
        let mut last = corners[0];
        let mut max: f64 = 0.0;
        for i in 0..parts {
            for j in u32::from(i == 0)..parts - i {
                if enough(max) {
                    return max;
                }
                let shown = a + (b - a) * part(i) + (c - a) * part(j);
                let texel = d + (e - d) * part(i) + (f - d) * part(j);
                let mut min = f64::INFINITY;
                // The face of the point before is probably near. Another start matters only if it lowers the maximum.
                for start in std::iter::once(last).chain(corners) {
                    if let Some((face, squared)) = self.walk(start, texel, shown, &mut been)
                        && squared < min
                    {
                        (min, last) = (squared, face);
                    }
                    if min <= max {
                        break;
                    }
                }
                max = if min < f64::INFINITY { max.max(min) } else { max };
            }
        }
        max
    }
}

/// The ends of the side opposite to each corner, in the face's direction.
fn side_ends([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[b, c], [c, a], [a, b]]
}

#[cfg(test)]
mod tests {
    use super::super::curve::Curve;
    use super::super::surface::Normalisation;
    use super::*;
    use crate::model::named;

    fn textured(model: &Model) -> (WorkingMesh, Normalisation, ModelTexture) {
        let curve = Curve::of(model);
        let (surface, units) = WorkingMesh::new(model, &curve);
        let texture = ModelTexture::of(model, &surface, &WedgeLists::new(model, &curve)).unwrap();
        (surface, units, texture)
    }

    /// A plane model whose texture coordinates are functions of the points.
    fn plane(points: &[[f64; 2]], faces: Vec<[u32; 3]>, st: impl Fn(&[f64; 2]) -> [f32; 2]) -> Model {
        let mut model = Model {
            positions: points.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect(),
            wedge_positions: (0..points.len() as u32).collect(),
            faces,
            ..Model::default()
        };
        model.attributes.coordinates = points.iter().map(st).collect();
        model
    }

    /// Asserts that walks from all faces find the middles of all faces.
    fn all_middles_are_found(model: &Model) {
        let (surface, _, texture) = textured(model);
        let faces = 0..surface.faces() as u32;
        for face in faces.clone() {
            let wedges = texture.faces[face as usize].map(|wedge| texture.coordinates[wedge as usize]);
            let (texel, point) =
                (wedges.iter().sum::<DVec2>() / 3.0, surface.triangle(face).iter().sum::<DVec3>() / 3.0);
            for start in faces.clone() {
                let (found, squared) = texture.walk(start, texel, point, &mut Vec::new()).unwrap();
                assert!(found == face && squared < 1e-24, "{start} to {face}: {found}, {squared}");
            }
        }
    }

    #[test]
    fn walks_find_all_texels_also_across_creases_and_where_the_straight_way_goes_around_in_a_circle() {
        all_middles_are_found(&named("knot:8").unwrap());
        // Every corner has its own normal, and so its own wedge.
        let mut flat = named("grid:9").unwrap();
        flat.attributes.coordinates = flat
            .wedge_positions
            .iter()
            .map(|&p| flat.positions[p as usize].truncate().as_vec2().to_array())
            .collect();
        let corners: Vec<u32> = flat.faces.iter().flatten().copied().collect();
        let coordinates = corners.iter().map(|&wedge| flat.attributes.coordinates[wedge as usize]).collect();
        flat.attributes.normals = (0..corners.len()).map(|corner| [corner as f32, 0.0, 1.0]).collect();
        flat.attributes.coordinates = coordinates;
        flat.wedge_positions = corners.iter().map(|&wedge| flat.wedge_positions[wedge as usize]).collect();
        flat.faces =
            (0..flat.faces.len() as u32).map(|face| [0, 1, 2].map(|corner| 3 * face + corner)).collect();
        all_middles_are_found(&flat);
        // A square within a turned square. Always crossing the side beyond which the texel lies farthest would visit
        // the eight faces between the squares again and again.
        let square = |radius: f64, turn: f64| {
            (0..4)
                .map(move |n| (turn + f64::from(n) * 90.0).to_radians())
                .map(move |a| [radius * a.cos(), radius * a.sin()])
        };
        let points: Vec<[f64; 2]> =
            [[0.05, 0.03]].into_iter().chain(square(1.0, 0.0)).chain(square(3.0, -26.0)).collect();
        let ring = |n: u32| {
            let (a, b, c, d) = (1 + n, 1 + (n + 1) % 4, 5 + n, 5 + (n + 1) % 4);
            [[0, a, b], [a, c, d], [a, d, b]]
        };
        let faces: Vec<[u32; 3]> = (0..4).flat_map(ring).collect();
        all_middles_are_found(&plane(&points, faces, |point| point.map(|x| x as f32)));
    }

    #[test]
    fn a_walk_stays_on_its_side_of_a_seam() {
        // Two copies of one grid, with the same coordinates.
        let grid = named("grid:9").unwrap();
        let count = grid.positions.len() as u32;
        let both = |z: f64| grid.positions.iter().map(move |p| DVec3::new(p.x, p.y, z));
        let mut model = Model {
            positions: both(0.0).chain(both(1.0)).collect(),
            wedge_positions: (0..2 * count).collect(),
            faces: grid
                .faces
                .iter()
                .copied()
                .chain(grid.faces.iter().map(|face| face.map(|v| v + count)))
                .collect(),
            ..Model::default()
        };
        let st = |p: &DVec3| p.truncate().as_vec2().to_array();
        model.attributes.coordinates = model.positions.iter().map(st).collect();
        let (surface, _, texture) = textured(&model);
        for start in 0..surface.faces() as u32 {
            let walk = |s| texture.walk(start, DVec2::new(s, 0.2), DVec3::ZERO, &mut Vec::new());
            let (found, _) = walk(0.1).unwrap();
            assert_eq!(surface.triangle(found)[0].z, surface.triangle(start)[0].z);
            assert!(walk(9.0).is_none());
        }
    }

    #[test]
    fn the_shift_of_a_face_is_that_of_its_texels_and_zero_on_the_model() {
        let (surface, _, texture) = textured(&named("knot:8").unwrap());
        let wedges = texture.faces[7];
        let squared = |points, enough: &dyn Fn(f64) -> bool| texture.squared_shift(points, wedges, 6, enough);
        assert!(squared(surface.triangle(7), &|_| false) < 1e-24);
        // The face is moved: all of its texels are as far away as its corners.
        let moved = surface.triangle(7).map(|point| point + DVec3::new(0.3, 0.0, 0.4));
        assert!((squared(moved, &|_| false) - 0.25).abs() < 1e-12);
        assert_eq!(squared(moved, &|_| true), 0.0, "stops before the first point");
    }

    #[test]
    fn where_a_texture_is_mirrored_the_nearest_place_counts() {
        // Columns of positions at x = -3 to 3, and s is the distance from the mirror line x = 0.
        let points: Vec<[f64; 2]> =
            (-3..=3).flat_map(|x| [[f64::from(x), 0.0], [f64::from(x), 1.0]]).collect();
        let cell = |n: u32| [[2 * n, 2 * n + 2, 2 * n + 1], [2 * n + 1, 2 * n + 2, 2 * n + 3]];
        let model = plane(&points, (0..6).flat_map(cell).collect(), |[x, y]| [x.abs() as f32, *y as f32]);
        let (_, units, texture) = textured(&model);
        let wedge = |x: f64, y: f64| points.iter().position(|point| *point == [x, y]).unwrap() as u32;
        let wedges = [wedge(-1.0, 0.0), wedge(2.0, 0.0), wedge(2.0, 1.0)];
        let corners = wedges.map(|wedge| texture.points[wedge as usize]);
        let shift = units.outside(texture.squared_shift(corners, wedges, 12, |_| false).sqrt());
        // At x = 0 the face shows s = 4/3, and the model does at x = 4/3 and -4/3. Farther east or west the nearest
        // place is nearer. On the wrong side it would be up to 4 away.
        assert!((shift - 4.0 / 3.0).abs() < 1e-6, "{shift}");
    }

    #[test]
    fn where_a_texture_varies_in_one_direction_the_nearest_point_of_its_line_counts() {
        let mut model = named("grid:17").unwrap();
        model.positions.iter_mut().for_each(|p| p.z = 0.0);
        let half = model.positions.iter().map(|p| p.x).fold(0.0, f64::max);
        // The wedge nearest to a corner of the square.
        let corner = |x: f64, y: f64| {
            let distance = |wedge: &u32| {
                let p = model.positions[model.wedge_positions[*wedge as usize] as usize];
                p.distance_squared(DVec3::new(x * half, y * half, 0.0))
            };
            let wedges = 0..model.wedge_positions.len() as u32;
            wedges.min_by(|x, y| distance(x).total_cmp(&distance(y))).unwrap()
        };
        let wedges = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)];
        // s is 0 at the western border, 1 in the middle and 4 at the eastern border.
        let st = |x: f64| if x < 0.0 { 1.0 + x / half } else { 1.0 + 3.0 * x / half };
        for [to_s, to_t] in [[1.0, 0.0], [0.0, 1.0], [0.31, -0.73]] {
            let at = |&position: &u32| {
                let s = st(model.positions[position as usize].x);
                [(to_s * s) as f32, (to_t * s) as f32]
            };
            let coordinates = model.wedge_positions.iter().map(at).collect();
            let mut model = model.clone();
            model.attributes.coordinates = coordinates;
            let (_, units, texture) = textured(&model);
            assert!(texture.flat.iter().all(|flat| *flat));
            let corners = wedges.map(|wedge| texture.points[wedge as usize]);
            let shift = units.outside(texture.squared_shift(corners, wedges, 12, |_| false).sqrt()) / half;
            // The face shows s = 1 halfway from the western border to the middle, and the model shows it in the middle.
            assert!((shift - 0.5).abs() < 1e-6, "{shift}");
        }
    }
    #[test]
    fn a_walk_along_a_line_ends_at_its_nearest_point_or_without_a_result() {
        // A strip of 600 faces from west to east; only t varies, from south to north.
        let points: Vec<[f64; 2]> =
            (0..=300).flat_map(|x| [[f64::from(x), 0.0], [f64::from(x), 1.0]]).collect();
        let cell = |n: u32| [[2 * n, 2 * n + 2, 2 * n + 1], [2 * n + 1, 2 * n + 2, 2 * n + 3]];
        let model = plane(&points, (0..300).flat_map(cell).collect(), |[_, y]| [0.25, *y as f32]);
        let (_, units, texture) = textured(&model);
        let [west, east] = [0.0, 300.0].map(|x| {
            let wedge = points.iter().position(|point| *point == [x, 0.0]).unwrap();
            (texture.starts[wedge], texture.points[wedge])
        });
        let walk = |part: f64| {
            let shown = west.1.lerp(east.1, part);
            texture.walk(west.0, DVec2::new(0.25, 0.5), shown, &mut Vec::new())
        };
        let shift = |part| walk(part).map(|(_, squared)| units.outside(squared.sqrt()));
        // All points shown lie on the southern border, half a cell from the line.
        assert!([0.0, 0.1, 0.4].iter().all(|&part| (shift(part).unwrap() - 0.5).abs() < 1e-6));
        assert_eq!(shift(0.5), None, "300 faces away");
    }
}
