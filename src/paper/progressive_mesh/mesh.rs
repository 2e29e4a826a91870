//! A progressive mesh as it is executed and stored: two buffers, the splits, and the permutations (paper 2, sections 4
//! and 5).
//!
//! Differs from the paper: a split may add several vertices. On a seam the position that a split adds has
//! several wedges (vertices), each with its own `splitVert`. A connected component that the simplifier
//! removed as a whole appears in a single split, and its vertices replace no vertex.

use super::choices::ErrorMetric;
use crate::math::ragged::Ragged;
use crate::model::Attributes;
use glam::DVec3;

pub use super::simplify::NOWHERE;

/// A mesh at every level of detail. Level i has i splits applied; level 0 is M0, level n the full mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProgressiveMesh {
    /// The paper's V for all levels: level i uses the first `levels[i].vertices` vertices.
    pub vertices: Vertices,
    /// The paper's F at level 0, with the slots of all levels: the first `levels[0].faces` are live. Each
    /// other slot holds its face with the corners that the face has when a split adds it.
    pub faces: Vec<[u32; 3]>,
    /// n + 1 levels, coarsest first.
    pub levels: Vec<Level>,
    /// The splits of the vertices beyond level 0, in their order.
    pub splits: Splits,
    /// The permutations of faces, coarsest level first.
    pub swaps: Swaps,
    /// Where new faces are in the index buffer.
    pub births: Births,
    /// The metric of the levels' errors; `None` if it is not known.
    pub metric: Option<ErrorMetric>,
}

/// Where new faces are in the index buffer at the levels between two permutations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Births {
    /// As in the paper: each split appends its faces to the live prefix.
    #[default]
    Tail,
    /// In place (ours). The levels from one permutation's level to the level before the next permutation form a group.
    /// All levels of a group draw the same faces in the same order. These are the faces that are live at the level of
    /// the next permutation (or at the last level), in the order after that permutation. A vertex that is not yet live
    /// is replaced by its predecessor, so unborn faces are degenerate.
    InPlace,
}

/// The live elements of a level, and its deviation from the full mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Level {
    /// `CurNumVerts`.
    pub vertices: u32,
    /// `CurNumTris`: the live prefix of F, in faces.
    pub faces: u32,
    /// Deviation from the full mesh in object units. It never increases with the level, and is 0 at the last level.
    pub error: f32,
}

/// The contents of the vertex buffer: one entry per vertex (a wedge of the model).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vertices {
    /// Centre of the positions' box, in object units.
    pub centre: DVec3,
    /// Positions less `centre`, rounded to f32.
    pub positions: Vec<[f32; 3]>,
    /// For each vertex the first vertex at the same position.
    pub welded: Vec<u32>,
    pub attributes: Attributes,
}

/// For each vertex that level 0 does not have: the vertex that it replaces, and the slots in which it replaces that
/// vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Splits {
    /// The paper's `splitVert`, or [`NOWHERE`] if nothing is replaced.
    pub split_vertices: Vec<u32>,
    /// The paper's `f1 … f_numF`: slots in which the new vertex replaces `splitVert`, ascending. Only faces
    /// that are live at the level before are listed; a new face already has its corners.
    pub slots: Ragged<u32>,
}

/// The paper's `tswap`s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Swaps {
    /// Levels with permutations, ascending. A permutation is executed after the splits that lead up to its level, and
    /// inverted before the collapses that lead down from this level.
    pub levels: Vec<u32>,
    /// For each of `levels`, the number of cycles of this level and all earlier levels.
    pub cycle_ends: Vec<u32>,
    /// The cycles: slots `f1 … f_numF` of one `tswap` each; no slot is in two cycles of one level. Normal form: each
    /// cycle begins with its lowest slot, and the cycles of a level are sorted by this slot.
    pub cycles: Ragged<u32>,
}

impl ProgressiveMesh {
    /// n: the level of the full mesh.
    ///
    /// # Panics
    /// If there are no levels.
    pub fn last_level(&self) -> u32 {
        u32::try_from(self.levels.len() - 1).expect("fewer than 2^32 levels")
    }
}

impl ProgressiveMesh {
    /// The vertex from which each vertex splits; a vertex of level 0 is its own predecessor. A vertex that replaces no
    /// vertex has the predecessor of another new vertex of its level. If no new vertex of the level replaces a vertex,
    /// the predecessor is vertex 0.
    pub fn predecessors(&self) -> Vec<u32> {
        let first = self.levels.first().map_or(0, |level| level.vertices);
        let mut predecessors: Vec<u32> = (0..first).collect();
        for pair in self.levels.windows(2) {
            let rows = (pair[0].vertices - first) as usize..(pair[1].vertices - first) as usize;
            let splits = &self.splits.split_vertices[rows];
            let other = splits.iter().copied().find(|&split| split != NOWHERE).unwrap_or(0);
            predecessors.extend(splits.iter().map(|&split| if split == NOWHERE { other } else { split }));
        }
        predecessors
    }
}

impl Swaps {
    /// The cycles of the permutation of `levels[index]`, as a range of rows of `cycles`.
    pub fn cycles_of(&self, index: usize) -> std::ops::Range<usize> {
        let start = if index == 0 { 0 } else { self.cycle_ends[index - 1] };
        start as usize..self.cycle_ends[index] as usize
    }
}
