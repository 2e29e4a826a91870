//! Small holes. Once the deviation reaches half the diagonal of the box around a hole, the hole's border no longer
//! restricts collapses: even moving all of it to the middle of the box would not be a larger error. Borders that share
//! a position count as one.

use super::components::root;
use super::surface::WorkingMesh;
use glam::DVec3;

/// The sizes of the borders at each position.
pub struct BorderRadii {
    /// For each position half the diagonal of the box around its connected borders, in the simplifier's units;
    /// infinite if it is on no border.
    radii: Vec<f64>,
    /// The largest deviation so far. Borders with at most this radius are free.
    pub deviation: f64,
}

impl BorderRadii {
    /// No borders.
    pub fn none(positions: usize) -> BorderRadii {
        BorderRadii { radii: vec![f64::INFINITY; positions], deviation: 0.0 }
    }

    /// The borders that consist of these edges.
    pub fn new(edges: &[[u32; 2]], surface: &WorkingMesh, positions: usize) -> BorderRadii {
        let mut parents: Vec<u32> = (0..positions as u32).collect();
        for &[a, b] in edges {
            let (root, joined) = (root(&mut parents, a), root(&mut parents, b));
            parents[root.max(joined) as usize] = root.min(joined);
        }
        let mut boxes = vec![[DVec3::MAX, DVec3::MIN]; positions];
        for &position in edges.as_flattened() {
            let [low, high] = &mut boxes[root(&mut parents, position) as usize];
            let point = surface.point(position);
            (*low, *high) = (low.min(point), high.max(point));
        }
        let mut borders = BorderRadii::none(positions);
        for &position in edges.as_flattened() {
            let [low, high] = boxes[root(&mut parents, position) as usize];
            borders.radii[position as usize] = (high - low).length() / 2.0;
        }
        borders
    }

    /// The radius of the borders at a position, infinite if there are none.
    pub fn at(&self, position: u32) -> f64 {
        self.radii[position as usize]
    }

    /// True if a border edge between these positions is free.
    pub fn is_free(&self, edge: [u32; 2]) -> bool {
        edge.iter().any(|&position| self.at(position) <= self.deviation)
    }

    /// To be called when `from` collapses onto `to`: its border edges are at `to` now.
    pub fn pass_on(&mut self, from: u32, to: u32) {
        if self.at(to) == f64::INFINITY {
            self.radii[to as usize] = self.at(from);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::curve::Curve;
    use super::*;
    use crate::model::named;

    #[test]
    fn a_border_is_free_once_the_deviation_reaches_half_of_its_diagonal() {
        let model = named("grid:5").unwrap();
        let curve = Curve::of(&model);
        let (surface, _) = WorkingMesh::new(&model, &curve);
        // Two borders of two edges each: the corners 0, 1, 2 and 20, 21, 22 of the grid.
        let at = |position: usize| curve.places[position];
        let edges = [[0, 1], [1, 2], [21, 20], [22, 21]].map(|edge| edge.map(at));
        let mut borders = BorderRadii::new(&edges, &surface, model.positions.len());
        let radius = |ends: [usize; 2]| {
            let [a, b] = ends.map(|end| surface.point(at(end)));
            (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt() / 2.0
        };
        assert!(borders.at(at(1)) >= radius([0, 2]) && borders.at(at(1)) == borders.at(at(2)));
        assert!(borders.at(at(21)) >= radius([20, 22]) && borders.at(at(12)) == f64::INFINITY);
        borders.deviation = borders.at(at(1));
        assert!(borders.is_free([at(1), at(12)]) && !borders.is_free([at(12), at(13)]));
        borders.pass_on(at(1), at(12));
        borders.pass_on(at(1), at(21));
        assert_eq!(borders.at(at(12)), borders.at(at(1)));
        assert!(borders.is_free([at(12), at(13)]));
        assert_eq!(borders.at(at(21)), borders.at(at(20)), "a position keeps the radius of its own borders");
    }
}
