//! Simplification: a model becomes a sequence of half-edge collapses (paper 2, sections 3 and 4; the simplifier itself
//! is a gap of the paper, which takes any).
//!
//! Ours: the cheapest collapse first, by the quadric error of Garland and Heckbert (1997) and, beside it, by the distance
//! that is measured: each vanished position belongs to the face nearest to it (`lost`), and each new face is
//! sampled against those it replaces. Positions on a border or seam move only along it; where these end or cross, they
//! stay. Small holes close, sheets may come to touch where a handle or neck is thin, and components vanish as a whole
//! once the mesh deviates by no less than their extent. Where nothing is left that keeps to these rules, they are
//! relaxed in two steps ([`Report`] counts what that did), and at last the smallest component goes.

mod components;
mod curve;
mod hub;
mod lost;
mod quadric;
mod queue;
mod sequence;
mod shape;
mod start;
mod step;
mod surface;
mod triangle;

use crate::math::ragged::Ragged;
use crate::model::Model;
use serde::Serialize;

/// Collapses from the full model down to the base mesh M0, the first one first. Indices are the model's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Collapses {
    /// For each collapse the deviation from the full model after it, in object units; never decreases. An estimate from
    /// above of the Hausdorff distance: for the model's positions it is their distance to the nearest of the faces
    /// near them, which bounds theirs to the whole; for the faces that are left, six samples of each were measured
    /// against the faces before, and the distances of these added. Where a component vanishes, its extent, however far
    /// it was from what is left.
    pub errors: Vec<f64>,
    /// For each collapse the wedges that it removes, each with the wedge that takes its place in the faces that
    /// stay; [`NOWHERE`] where none stays (a component vanishes as a whole). All wedges of one position, or of all
    /// positions of a component.
    pub wedges: Ragged<[u32; 2]>,
    /// For each collapse the faces that it removes: at least one.
    pub faces: Ragged<u32>,
}

impl Collapses {
    /// How many collapses leave no more than `faces` of a model's faces; all of them if none do.
    pub fn steps_to(&self, model: &Model, faces: usize) -> usize {
        let mut left = model.faces.len();
        let enough = self.faces.rows().position(|row| {
            let reached = left <= faces;
            left -= row.len();
            reached
        });
        enough.unwrap_or(self.errors.len())
    }

    /// The faces that the first `steps` collapses leave, by wedge, in the model's order.
    ///
    /// # Panics
    /// If there are fewer collapses, or if they are another model's.
    pub fn faces_after(&self, model: &Model, steps: usize) -> Vec<[u32; 3]> {
        let mut live = vec![true; model.faces.len()];
        let mut targets: Vec<u32> = (0..model.wedge_positions.len() as u32).collect();
        // Backwards: what takes a wedge's place then has its own last place already.
        for step in (0..steps).rev() {
            self.faces.row(step).iter().for_each(|&face| live[face as usize] = false);
            for &[from, to] in self.wedges.row(step) {
                targets[from as usize] = if to == NOWHERE { NOWHERE } else { targets[to as usize] };
            }
        }
        let left = model.faces.iter().zip(live).filter(|(_, live)| *live);
        left.map(|(face, _)| face.map(|wedge| targets[wedge as usize])).collect()
    }

    /// The error after the first `steps` collapses: 0 for the model itself.
    pub fn error_after(&self, steps: usize) -> f64 {
        if steps == 0 { 0.0 } else { self.errors[steps - 1] }
    }
}

/// The target of a wedge that vanishes with all its faces.
pub const NOWHERE: u32 = u32::MAX;

/// What to simplify to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimplifyOptions {
    /// Faces of the base mesh: no collapse begins when there are no more than these.
    pub target_faces: usize,
    /// Which of collapses that cost the same comes first: with 0 the one that stands first along a curve through space,
    /// with any other seed it is decided by lot. What differs between seeds is what chance decides of a result.
    pub seed: u64,
}

impl Default for SimplifyOptions {
    fn default() -> Self {
        SimplifyOptions { target_faces: 64, seed: 0 }
    }
}

/// A model's collapses, and what became of the wishes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Simplified {
    pub collapses: Collapses,
    pub report: Report,
}

/// What was wanted, what was reached, and what had to be allowed on the way.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Report {
    pub target_faces: usize,
    pub seed: u64,
    /// Faces of the base mesh.
    pub faces: usize,
    /// Collapses of one position onto another.
    pub collapses: usize,
    /// Components that vanished as a whole.
    pub components: usize,
    /// Collapses that closed a hole of three edges.
    pub closed_holes: usize,
    /// Collapses that made two sheets share an edge.
    pub pinches: usize,
    /// Collapses that turned a face by more than 75 degrees, or left it without area.
    pub flips: usize,
    /// Collapses after which borders and seams no longer held.
    pub crossing: usize,
    /// Why there are more faces than wanted.
    pub shortfall: Option<&'static str>,
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
mod tests;
