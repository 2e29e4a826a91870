//! Simplification: a model becomes a sequence of half-edge collapses (paper 2, sections 3 and 4; the simplifier itself
//! is a gap of the paper).

mod hub;
mod lost;
mod quadric;
mod queue;
mod sequence;
mod surface;

use crate::math::ragged::Ragged;
use crate::scene::model::Model;

/// Collapses from the full model down to the base mesh M0, the first one first. Indices are the model's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Collapses {
    /// For each collapse the deviation from the full model after it, in object units; never decreases.
    pub errors: Vec<f64>,
    /// For each collapse the wedges that it removes, each with the wedge that takes its place in the faces that
    /// stay; [`NOWHERE`] where none stays (a component vanishes as a whole). All wedges of one position, or of all
    /// positions of a component.
    pub wedges: Ragged<[u32; 2]>,
    /// For each collapse the faces that it removes: at least one.
    pub faces: Ragged<u32>,
}

/// The target of a wedge that vanishes with all its faces.
pub const NOWHERE: u32 = u32::MAX;

/// What to simplify to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimplifyOptions {
    /// Faces of the base mesh: no collapse begins when there are no more than these.
    pub target_faces: usize,
}

impl Default for SimplifyOptions {
    fn default() -> Self {
        SimplifyOptions { target_faces: 64 }
    }
}

/// A model's collapses, and what became of the wishes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Simplified {
    pub collapses: Collapses,
    pub report: Report,
}

/// What was wanted and what was reached.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    pub target_faces: usize,
    /// Faces of the base mesh.
    pub faces: usize,
}

/// Simplifies a model as far as wanted. `progress` is called now and then with the number of faces that are removed
/// and the number to remove.
pub fn simplify(
    model: &Model,
    options: &SimplifyOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> Simplified {
    let mut sequence = sequence::Sequence::new(model, options);
    sequence.run(progress);
    sequence.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// A closed torus of 2 n m faces around the origin.
    fn torus(n: u32, m: u32) -> Model {
        let at = |i: u32, j: u32| {
            let turn = |k: u32, of: u32| f64::from(k) / f64::from(of) * std::f64::consts::TAU;
            let (a, b) = (turn(i, n), turn(j, m));
            let radius = 1.0 + 0.4 * b.cos();
            DVec3::new(radius * a.cos(), radius * a.sin(), 0.4 * b.sin())
        };
        let id = |i: u32, j: u32| (j % m) * n + i % n;
        let quads = (0..m).flat_map(|j| (0..n).map(move |i| (i, j)));
        let halves = |(i, j)| {
            let (a, b, c, d) = (id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
            [[a, b, c], [a, c, d]]
        };
        Model {
            faces: quads.clone().flat_map(halves).collect(),
            positions: quads.map(|(i, j)| at(i, j)).collect(),
            wedge_positions: (0..n * m).collect(),
            ..Model::default()
        }
    }

    /// The faces that are left after all collapses, by wedge.
    fn base(model: &Model, collapses: &Collapses) -> Vec<[u32; 3]> {
        let mut wedges: Vec<u32> = (0..model.wedge_positions.len() as u32).collect();
        let mut live = vec![true; model.faces.len()];
        for step in 0..collapses.errors.len() {
            for &face in collapses.faces.row(step) {
                assert!(std::mem::replace(&mut live[face as usize], false), "face {face} vanishes twice");
            }
            for &[from, to] in collapses.wedges.row(step) {
                wedges.iter_mut().filter(|wedge| **wedge == from).for_each(|wedge| *wedge = to);
            }
        }
        let faces = model.faces.iter().zip(live).filter(|(_, live)| *live);
        faces.map(|(face, _)| face.map(|wedge| wedges[wedge as usize])).collect()
    }

    #[test]
    fn a_torus_stays_a_closed_surface_of_one_handle() {
        let model = torus(48, 24);
        let options = SimplifyOptions { target_faces: 64 };
        let Simplified { collapses, report } = simplify(&model, &options, &mut |_, _| {});
        let faces = base(&model, &collapses);
        assert_eq!((faces.len(), report.faces), (64, 64));
        let edge = |face: &[u32; 3], k: usize| (face[k], face[(k + 1) % 3]);
        let edges: std::collections::HashSet<_> =
            faces.iter().flat_map(|face| (0..3).map(move |k| edge(face, k))).collect();
        assert_eq!(edges.len(), 3 * faces.len(), "an edge has two faces in the same direction");
        assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))), "an edge has no other face");
        let vertices: std::collections::HashSet<_> = faces.iter().flatten().collect();
        assert_eq!(vertices.len() + faces.len(), edges.len() / 2, "Euler's number of a torus is 0");
        assert!(collapses.errors.is_sorted() && collapses.errors[0] > 0.0);
    }

    #[test]
    fn where_and_how_large_a_model_is_changes_nothing() {
        let model = torus(24, 12);
        let options = SimplifyOptions { target_faces: 100 };
        let plain = simplify(&model, &options, &mut |_, _| {}).collapses;
        for (scale, origin) in [(2.0_f64.powi(-300), 0.0), (2.0_f64.powi(300), 0.0), (1.0, 1048576.0)] {
            let mut moved = model.clone();
            moved.positions.iter_mut().for_each(|p| *p = *p * scale + origin);
            let found = simplify(&moved, &options, &mut |_, _| {}).collapses;
            assert_eq!(found.errors.len(), plain.errors.len());
            if origin == 0.0 {
                assert_eq!(found.wedges, plain.wedges);
                assert!(found.errors.iter().zip(&plain.errors).all(|(f, p)| *f == p * scale));
            }
        }
    }
}
