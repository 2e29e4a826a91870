//! Texture coordinates: how far a collapse shifts the texture.
//!
//! A face interpolates the texture coordinates of its corners, so a level shows a texel elsewhere than the model. The
//! shift is the distance between these two places. It is measured at points of the new faces, like their distance from
//! the model (`farthest`). The model's place of a texel is found by a walk over the model's faces in the plane of
//! texture coordinates. The walk starts at a corner of the new face and never crosses a seam, so it finds the right
//! place where coordinates repeat or overlap, too. J. Cohen, M. Olano and D. Manocha ("Appearance-Preserving
//! Simplification", SIGGRAPH 1998) measure the same shift, where edges of the model and of the level cross in this
//! plane.
//!
//! Before, the shift was estimated to first order at vanished positions. The largest shift was then 1.44 times the stated
//! error (pm.texture, globe, a quarter of the faces), because it often lies between these positions.

use super::surface::WorkingMesh;
use crate::model::Model;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Marks a side of a face without a neighbour.
const NONE: u32 = u32::MAX;

/// A walk of more faces ends without a result. Where coordinates fold over, a walk could go around in a circle.
const MAX_FACES: usize = 256;

/// A texel belongs to a face if its barycentric coordinates are at least this, so that a texel on an edge belongs to
/// both faces.
const INSIDE: f64 = -1e-9;

/// The model's faces in the plane of texture coordinates.
pub struct ModelTexture {
    /// Texture coordinates of each wedge.
    pub coordinates: Vec<DVec2>,
    /// Each wedge's point.
    points: Vec<DVec3>,
    /// A face with each wedge.
    starts: Vec<u32>,
    /// Wedges of each face.
    faces: Vec<[u32; 3]>,
    /// For each face and corner the face across the opposite side, or [`NONE`] at a seam or border.
    across: Vec<[u32; 3]>,
}

impl ModelTexture {
    /// `None` without texture coordinates. `surface` has all of the model's faces.
    pub fn of(model: &Model, surface: &WorkingMesh) -> Option<ModelTexture> {
        let own = |st: &[f32; 2]| DVec2::from(st.map(f64::from));
        let coordinates: Vec<DVec2> = model.attributes.coordinates.iter().map(own).collect();
        if coordinates.is_empty() {
            return None;
        }
        let (mut points, mut starts) = (vec![DVec3::ZERO; coordinates.len()], vec![0; coordinates.len()]);
        let faces: Vec<[u32; 3]> = (0..surface.faces() as u32)
            .map(|face| [0, 1, 2].map(|corner| surface.wedge(face, corner)))
            .collect();
        let mut sides = HashMap::new();
        for (face, wedges) in (0..).zip(&faces) {
            for (wedge, point) in wedges.iter().zip(surface.triangle(face)) {
                (points[*wedge as usize], starts[*wedge as usize]) = (point, face);
            }
            side_ends(wedges).into_iter().for_each(|ends| _ = sides.insert(ends, face));
        }
        let beyond = |[from, to]: [u32; 2]| sides.get(&[to, from]).copied().unwrap_or(NONE);
        let across = faces.iter().map(|wedges| side_ends(wedges).map(beyond)).collect();
        Some(ModelTexture { coordinates, points, starts, faces, across })
    }

    /// Where the model shows a texel, and the face there. The walk starts at a face; `None` if a seam or border ends it.
    fn walk(&self, start: u32, texel: DVec2) -> Option<(u32, DVec3)> {
        let mut face = start;
        for _ in 0..MAX_FACES {
            let wedges = self.faces[face as usize];
            let [a, b, c] = wedges.map(|wedge| self.coordinates[wedge as usize]);
            let (ab, ac, at) = (b - a, c - a, texel - a);
            let area = ab.perp_dot(ac);
            if area == 0.0 {
                return None;
            }
            let (v, w) = (at.perp_dot(ac) / area, ab.perp_dot(at) / area);
            let weights = [1.0 - v - w, v, w];
            let least = if v < w { 1 } else { 2 };
            let least = if weights[least] < weights[0] { least } else { 0 };
            if weights[least] >= INSIDE {
                let [a, b, c] = wedges.map(|wedge| self.points[wedge as usize]);
                return Some((face, a + (b - a) * v + (c - a) * w));
            }
            face = self.across[face as usize][least];
            if face == NONE {
                return None;
            }
        }
        None
    }

    /// The largest squared shift at points of a face with these corners and wedges. Its sides are divided into `parts`;
    /// the corners and the side between the last two are left out. A texel that no walk reaches is left out, too: for
    /// example, the model does not show texels between the triangles of a pole. Stops early, with a shift that is too
    /// small, once `enough` returns true for it.
    pub fn squared_shift(
        &self,
        [a, b, c]: [DVec3; 3],
        wedges: [u32; 3],
        parts: u32,
        enough: impl Fn(f64) -> bool,
    ) -> f64 {
        let [d, e, f] = wedges.map(|wedge| self.coordinates[wedge as usize]);
        let [first, second, third] = wedges.map(|wedge| self.starts[wedge as usize]);
        let part = |count: u32| f64::from(count) / f64::from(parts);
        let mut last = first;
        let mut max: f64 = 0.0;
        for i in 0..parts {
            for j in u32::from(i == 0)..parts - i {
                if enough(max) {
                    return max;
                }
                let shown = a + (b - a) * part(i) + (c - a) * part(j);
                let texel = d + (e - d) * part(i) + (f - d) * part(j);
                // The face of the point before is probably near.
                let mut starts = [last, first, second, third].into_iter();
                if let Some((face, place)) = starts.find_map(|start| self.walk(start, texel)) {
                    last = face;
                    max = max.max(shown.distance_squared(place));
                }
            }
        }
        max
    }
}

/// The ends of the side opposite to each corner, in the face's direction.
fn side_ends([a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[*b, *c], [*c, *a], [*a, *b]]
}

#[cfg(test)]
mod tests {
    use super::super::curve::Curve;
    use super::*;
    use crate::model::named;

    #[test]
    fn a_walk_finds_the_place_of_each_texel_and_ends_at_the_border_of_the_coordinates() {
        let model = named("knot:8").unwrap();
        let (surface, _) = WorkingMesh::new(&model, &Curve::of(&model));
        let texture = ModelTexture::of(&model, &surface).unwrap();
        let middle =
            |wedges: [u32; 3]| wedges.map(|wedge| texture.coordinates[wedge as usize] / 3.0).iter().sum();
        let starts = [0, 100, model.faces.len() as u32 - 1];
        for face in 0..surface.faces() as u32 {
            let texel = middle([0, 1, 2].map(|corner| surface.wedge(face, corner)));
            let point = surface.triangle(face).iter().sum::<DVec3>() / 3.0;
            for start in [face].into_iter().chain(starts) {
                let (found, place) = texture.walk(start, texel).unwrap();
                assert!(
                    found == face && place.distance(point) < 1e-12,
                    "{start} to {face}: {found}, {place}"
                );
            }
        }
        for outside in [DVec2::new(-0.01, 0.5), DVec2::new(0.5, 1.01)] {
            assert!(starts.iter().all(|&start| texture.walk(start, outside).is_none()));
        }
    }

    #[test]
    fn the_shift_of_a_face_is_that_of_its_texels_and_zero_on_the_model() {
        let model = named("knot:8").unwrap();
        let (surface, _) = WorkingMesh::new(&model, &Curve::of(&model));
        let texture = ModelTexture::of(&model, &surface).unwrap();
        let wedges = [0, 1, 2].map(|corner| surface.wedge(7, corner));
        let squared = |points, enough: &dyn Fn(f64) -> bool| texture.squared_shift(points, wedges, 6, enough);
        assert!(squared(surface.triangle(7), &|_| false) < 1e-24);
        // The face is moved: all of its texels are as far away as its corners.
        let moved = surface.triangle(7).map(|point| point + DVec3::new(0.3, 0.0, 0.4));
        assert!((squared(moved, &|_| false) - 0.25).abs() < 1e-12);
        assert_eq!(squared(moved, &|_| true), 0.0, "stops before the first point");
    }
}
