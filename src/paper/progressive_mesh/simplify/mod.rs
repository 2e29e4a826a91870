//! Simplification: a model becomes a sequence of half-edge collapses (paper 2, sections 3 and 4; the paper accepts any
//! simplifier and does not describe one).
//!
//! Ours: the cheapest collapse first. The cost is the quadric error (Garland and Heckbert, "Surface Simplification Using
//! Quadric Error Metrics", SIGGRAPH 1997) plus the measured distance: each removed position is assigned to the face
//! nearest to it (`lost`), and each new face is measured against those it replaces (`farthest`). A second pass delays
//! collapses that deviate more than their neighbours in the sequence (`pace`), so that the stated error rises evenly.
//!
//! Positions on a border or seam move only along it; where borders or seams end or cross, they stay. Small holes close.
//! Sheets may touch where a handle or neck is thin. A component vanishes as a whole once the mesh deviates by at least
//! its extent. If no collapse satisfies these rules, they are relaxed in two steps ([`Report`] counts the collapses of
//! each), and in the end the smallest component is removed.

mod components;
mod curve;
mod farthest;
mod hub;
mod lost;
mod pace;
mod quadric;
mod queue;
mod sequence;
mod shape;
mod start;
mod stated;
mod step;
mod surface;
mod triangle;

use super::choices::BuildEffort;
use crate::math::ragged::Ragged;
use crate::model::Model;
use serde::Serialize;

/// Collapses from the full model down to the base mesh M0, the first one first. Indices are the model's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Collapses {
    /// For each collapse the deviation from the full model after it, in object units. For the model's positions: the
    /// distance to the nearest of the faces near them. For the remaining faces: at sample points, the distance from the
    /// replaced faces plus those faces' own distances. Where a component vanishes: its extent, regardless of its
    /// distance from the rest. Above 0 it rises evenly with every collapse (`stated`), so every level can be selected
    /// by its error.
    pub errors: Vec<f64>,
    /// For each collapse the wedges that it removes, each with its replacement in the remaining faces, or [`NOWHERE`]
    /// if there is none (a component vanishes as a whole). Contains all wedges of one position, or of all positions of
    /// a component.
    pub wedges: Ragged<[u32; 2]>,
    /// For each collapse the faces that it removes: at least one.
    pub faces: Ragged<u32>,
}

impl Collapses {
    /// The number of collapses that leave at most `faces` of a model's faces; all of them if none do.
    pub fn steps_to(&self, model: &Model, faces: usize) -> usize {
        let mut left = model.faces.len();
        let enough = self.faces.rows().position(|row| {
            let reached = left <= faces;
            left -= row.len();
            reached
        });
        enough.unwrap_or(self.errors.len())
    }

    /// The faces after the first `steps` collapses, by wedge, in the model's order.
    ///
    /// # Panics
    /// If there are fewer collapses, or if they belong to another model.
    pub fn faces_after(&self, model: &Model, steps: usize) -> Vec<[u32; 3]> {
        let mut live = vec![true; model.faces.len()];
        let mut targets: Vec<u32> = (0..model.wedge_positions.len() as u32).collect();
        // Backwards, so that the replacement of a wedge already has its own final replacement.
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
    /// Faces of the base mesh: no collapse begins at or below this number.
    pub target_faces: usize,
    /// The order of collapses of equal cost: with 0 the first along a space-filling curve, with any other seed random.
    /// The differences between seeds show how much of a result is due to chance.
    pub seed: u64,
    pub effort: BuildEffort,
}

impl Default for SimplifyOptions {
    fn default() -> Self {
        SimplifyOptions { target_faces: 64, seed: 0, effort: BuildEffort::Best }
    }
}

/// A model's collapses, and a report.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Simplified {
    pub collapses: Collapses,
    pub report: Report,
}

/// The request, the result, and the rules that had to be relaxed.
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
    /// Corners and vanished positions visited: proportional to the time.
    pub looks: usize,
    /// Why there are more faces than requested.
    pub shortfall: Option<&'static str>,
}

/// Simplifies a model to the target. `progress` is called now and then with the number of faces removed and the number
/// to remove, over all passes.
pub fn simplify(
    model: &Model,
    options: &SimplifyOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> Simplified {
    let mut sequence = sequence::Sequence::new(model, options, None);
    if options.effort == BuildEffort::Best {
        sequence.run(&mut |done, all| progress(done, 2 * all));
        let pace = pace::Pace::of(sequence.log());
        sequence = sequence::Sequence::new(model, options, pace);
        sequence.run(&mut |done, all| progress(all + done, 2 * all));
    } else {
        sequence.run(progress);
    }
    sequence.finish()
}

#[cfg(test)]
mod tests;
