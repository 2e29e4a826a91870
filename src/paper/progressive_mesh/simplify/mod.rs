//! Simplification: a model becomes a sequence of half-edge collapses (paper 2, sections 3 and 4; the paper accepts any
//! simplifier and does not describe one).
//!
//! Ours executes the cheapest collapse first. The cost is the quadric error (Garland and Heckbert, "Surface
//! Simplification Using Quadric Error Metrics", SIGGRAPH 1997) plus the measured distance. For this distance, each
//! removed position is assigned to the face nearest to it (`lost`), and each new face is measured against the faces
//! that it replaces and, with two passes, against the model's faces (`farthest`, `original`). A second pass delays
//! collapses that deviate more than their neighbours in the sequence (`pace`), so that the stated error rises evenly.
//! With [`ErrorMetric::Appearance`] the distance is at least the radius of the region in which normals differ visibly
//! (`shading`), and the distance by which texture coordinates shift (`texture`).
//!
//! Positions on a border or seam move only along it; where borders or seams end or cross, positions stay. Parts that
//! are narrower than the deviation of the mesh hold nothing back. A component vanishes as a whole once the deviation
//! reaches its extent. A border restricts no collapse once the deviation reaches half of its extent (`borders`), so
//! small holes close. Two sheets may share an edge where three edges around a handle or neck are together no longer
//! than the deviation. A tunnel becomes flat in this way: its faces lie back to back, and a collapse along one of their
//! edges removes both. On the dragon of 871,414 faces, 250 of the last 2,000 faces would otherwise lie around small
//! holes and handles, and the deviation at 1,000 faces would be three times as large.
//!
//! If no collapse satisfies these rules, they are relaxed in three steps; [`SimplifyReport`] counts the collapses of
//! each. The last step permits sheets to share edges everywhere. If no collapse is possible even then, the smallest
//! component is removed.
//!
//! One core runs it: each collapse changes the keys of its neighbours, so the next one is known only afterwards. A
//! trial examined the next 256 positions of the queue on two cores and found the same collapses, but in the same time
//! (one pass over the dragon: 19 to 21 s in both cases). It visited 17 % more corners, because collapses changed
//! positions after they were examined. What each collapse changed had to reach both cores. The orders with births in
//! place, which are computed afterwards, use all cores.

mod borders;
mod components;
mod curve;
mod farthest;
mod hub;
mod isoline;
mod lattice;
mod lost;
mod measure;
mod original;
mod pace;
mod quadric;
mod queue;
mod sequence;
mod shading;
mod shape;
mod start;
mod stated;
mod step;
mod surface;
mod texture;
mod triangle;
mod wedges;

use super::choices::{BuildEffort, ErrorMetric};
use crate::math::ragged::Ragged;
use crate::model::Model;
use serde::Serialize;

/// Collapses from the full model down to level 0 (the paper's M0), in order of execution. Indices are the
/// model's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Collapses {
    /// The deviation from the full model after each collapse, in object units: the maximum of three kinds of
    /// distances. Each of the model's positions, and points of folds and long edges, are measured to the nearest of
    /// the faces near them. The remaining faces are measured at sample points: the distance to the model's faces near
    /// the point, or to a replaced face plus that face's own distance from the model, whichever is less. A component
    /// that vanishes counts with its extent, regardless of its distance from the rest, and an edge that loses all
    /// faces counts with half of its length or more. With [`ErrorMetric::Appearance`] the shading error and the shift
    /// of the texture count too. Positive errors rise evenly with every collapse (`stated`), so every level can be
    /// selected by its error.
    pub errors: Vec<f64>,
    /// For each collapse the wedges that it removes, each with its replacement in the remaining faces. The
    /// replacement is [`NOWHERE`] if a component vanishes as a whole. A collapse removes all wedges of one
    /// position, or of all positions of a component.
    pub wedges: Ragged<[u32; 2]>,
    /// For each collapse the faces that it removes: at least one.
    pub faces: Ragged<u32>,
    /// What the errors count; `None` if it is not known.
    pub metric: Option<ErrorMetric>,
}

impl Collapses {
    /// The number of collapses needed to leave at most `faces` faces; all of them if they leave more.
    pub fn steps_to(&self, model: &Model, faces: usize) -> usize {
        let mut left = model.faces.len();
        let enough = self.faces.rows().position(|row| {
            let reached = left <= faces;
            left -= row.len();
            reached
        });
        enough.unwrap_or(self.errors.len())
    }

    /// The faces (as wedges) after the first `steps` collapses, in the model's order.
    ///
    /// # Panics
    /// If there are fewer collapses, or if they belong to another model.
    pub fn faces_after(&self, model: &Model, steps: usize) -> Vec<[u32; 3]> {
        let mut live = vec![true; model.faces.len()];
        let removed = (0..steps).flat_map(|step| self.faces.row(step));
        removed.for_each(|&face| live[face as usize] = false);
        let targets = self.targets_after(model, steps);
        let left = model.faces.iter().zip(live).filter(|(_, live)| *live);
        left.map(|(face, _)| face.map(|wedge| targets[wedge as usize])).collect()
    }

    /// The model's faces in the components that have not vanished after the first `steps` collapses.
    ///
    /// # Panics
    /// As [`Collapses::faces_after`].
    pub fn surviving_components(&self, model: &Model, steps: usize) -> Vec<[u32; 3]> {
        let targets = self.targets_after(model, steps);
        let survives = |face: &&[u32; 3]| face.iter().all(|&wedge| targets[wedge as usize] != NOWHERE);
        model.faces.iter().filter(survives).copied().collect()
    }

    /// For each wedge the wedge that replaces it after the first `steps` collapses, or [`NOWHERE`].
    fn targets_after(&self, model: &Model, steps: usize) -> Vec<u32> {
        let mut targets: Vec<u32> = (0..model.wedge_positions.len() as u32).collect();
        // Backwards, so that the replacement of a wedge is already final.
        for &[from, to] in (0..steps).rev().flat_map(|step| self.wedges.row(step)) {
            targets[from as usize] = if to == NOWHERE { NOWHERE } else { targets[to as usize] };
        }
        targets
    }

    /// The error after the first `steps` collapses: 0 for the model itself.
    pub fn error_after(&self, steps: usize) -> f64 {
        if steps == 0 { 0.0 } else { self.errors[steps - 1] }
    }
}

/// The target of a wedge that vanishes with all its faces.
pub const NOWHERE: u32 = u32::MAX;

/// The target of the simplification.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimplifyOptions {
    /// Faces of the base mesh: collapses stop at or below this number.
    pub target_faces: usize,
    /// Breaks ties between collapses of equal cost: 0 prefers the first along a space-filling curve, any
    /// other seed a random one. The differences between seeds show how much of a result is due to chance.
    pub seed: u64,
    pub effort: BuildEffort,
    pub metric: ErrorMetric,
}

impl Default for SimplifyOptions {
    fn default() -> Self {
        SimplifyOptions {
            target_faces: 64,
            seed: 0,
            effort: BuildEffort::Best,
            metric: ErrorMetric::Geometry,
        }
    }
}

/// A model's collapses, and a report.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Simplified {
    pub collapses: Collapses,
    pub report: SimplifyReport,
}

/// The request, the result, and how often rules were relaxed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SimplifyReport {
    pub target_faces: usize,
    pub seed: u64,
    /// Faces of the base mesh.
    pub faces: usize,
    /// Collapses of one position onto another.
    pub collapses: usize,
    /// Components that vanished as a whole.
    pub components: usize,
    /// Collapses that closed or narrowed a hole: two border edges became one edge of two faces.
    pub closed_holes: usize,
    /// Collapses that made two sheets share an edge.
    pub pinches: usize,
    /// Collapses that turned a face by more than 75 degrees, or left it without area.
    pub flips: usize,
    /// Collapses in phases in which borders and seams do not restrict the movement.
    pub crossing: usize,
    /// Corners and vanished positions visited; the running time is proportional to this number.
    pub looks: usize,
    /// Why there are more faces than requested.
    pub shortfall: Option<&'static str>,
}

/// Simplifies a model to the target. `progress` is called at intervals with the number of faces removed and
/// the number to remove, over all passes.
pub fn simplify(
    model: &Model,
    options: &SimplifyOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> Simplified {
    let mut sequence = sequence::Sequence::new(model, options, original::PARTS, None);
    if options.effort == BuildEffort::Best {
        sequence.run(&mut |done, all| progress(done, 2 * all));
        let pace = pace::DeviationKeys::of(sequence.log());
        sequence = sequence::Sequence::new(model, options, original::FINE_PARTS, pace);
        sequence.run(&mut |done, all| progress(all + done, 2 * all));
    } else {
        sequence.run(progress);
    }
    sequence.finish()
}

#[cfg(test)]
mod tests;
