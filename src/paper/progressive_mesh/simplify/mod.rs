//! Simplification: a model becomes a sequence of half-edge collapses (paper 2, sections 3 and 4; the simplifier itself
//! is a gap of the paper).

use crate::math::ragged::Ragged;

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
