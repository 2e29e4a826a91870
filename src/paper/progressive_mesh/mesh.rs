//! A progressive mesh as it is executed and stored: two buffers, the splits, and the permutations (paper 2, sections 4
//! and 5).
//!
//! Differs from the paper: a split may add several vertices, where the split position lies on a seam and so has
//! several wedges (each replaces its own vertex), or where a component appears as a whole (its vertices replace
//! nothing).

use crate::math::ragged::Ragged;
use crate::model::Attributes;
use glam::DVec3;

pub use super::simplify::NOWHERE;

/// A mesh at every level of detail. Level i = i splits are applied; level 0 is M0, level n the full mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProgressiveMesh {
    /// The paper's V for all levels: level i draws with the first `levels[i].vertices` of them.
    pub vertices: Vertices,
    /// The paper's F at level 0, with the slots of all levels: the first `levels[0].faces` are live. What stands
    /// in the others is what the splits find when they bring them to life.
    pub faces: Vec<[u32; 3]>,
    /// n + 1 levels, coarsest first.
    pub levels: Vec<Level>,
    /// What the vertices beyond those of level 0 do when they appear, in their order.
    pub splits: Splits,
    /// The permutations of faces, coarsest level first.
    pub swaps: Swaps,
}

/// What is live at a level, and how far it is from the full mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Level {
    /// `CurNumVerts`.
    pub vertices: u32,
    /// `CurNumTris`: the live prefix of F, in faces.
    pub faces: u32,
    /// Deviation from the full mesh in object units; never increases with the level, 0 at the last.
    pub error: f32,
}

/// The vertex buffer's content: one entry a vertex (a wedge of the model).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vertices {
    /// Centre of the positions' box, in object units.
    pub centre: DVec3,
    /// Positions less `centre`, rounded to f32.
    pub positions: Vec<[f32; 3]>,
    /// For each vertex the first vertex that has the same position: position-welded index space.
    pub welded: Vec<u32>,
    pub attributes: Attributes,
}

/// For each vertex beyond level 0's: which vertex it replaces, and where.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Splits {
    /// The paper's `splitVert`, or [`NOWHERE`] where nothing is replaced.
    pub split_vertices: Vec<u32>,
    /// The paper's `f1 … f_numF`: slots of the live faces in which the new vertex takes `splitVert`'s place,
    /// ascending. Of faces that were live at the level before: a face that appears has its corners already.
    pub slots: Ragged<u32>,
}

/// The paper's `tswap`s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Swaps {
    /// Levels that carry permutations, ascending: executed after the splits that lead to the level from below, and
    /// run backwards before the collapses that lead down from it.
    pub levels: Vec<u32>,
    /// For each of `levels` the number of cycles of it and all before it.
    pub cycle_ends: Vec<u32>,
    /// The cycles: slots `f1 … f_numF` of one `tswap` each; no slot is in two cycles of one level. Each begins
    /// with its least slot, and they stand in the order of these: one spelling for each permutation.
    pub cycles: Ragged<u32>,
}

impl ProgressiveMesh {
    /// n: the level of the full mesh.
    ///
    /// # Panics
    /// If there is no level at all.
    pub fn last_level(&self) -> u32 {
        u32::try_from(self.levels.len() - 1).expect("fewer than 2^32 levels")
    }
}

impl Swaps {
    /// The cycles of the permutation that is carried by `levels[index]`, as a range of rows of `cycles`.
    pub fn cycles_of(&self, index: usize) -> std::ops::Range<usize> {
        let start = if index == 0 { 0 } else { self.cycle_ends[index - 1] };
        start as usize..self.cycle_ends[index] as usize
    }
}
