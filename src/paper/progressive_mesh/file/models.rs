//! What is learnt while a file is written or read, and how much each kind of content takes.

use super::coder::{Bit, Number};

/// One model for each kind of symbol. They go on learning from chunk to chunk: a chunk can be read when all before
/// it were.
#[derive(Default)]
pub(super) struct Models {
    pub vertices: Number,
    pub faces: Number,
    pub error: Number,
    pub splits: SplitModels,
    pub births: BirthModels,
    pub permutation: PermutationModels,
    pub welded: Number,
    pub positions: [Number; 3],
    pub normals: [Number; 3],
    pub coordinates: [Number; 2],
    pub colors: [Number; 4],
}

/// Which vertex is replaced, and in which faces around it.
#[derive(Default)]
pub(super) struct SplitModels {
    pub nowhere: Bit,
    /// Whether it is a neighbour of the vertex before, and which.
    pub near: Bit,
    pub neighbour: Number,
    /// Else how old it is.
    pub age: Number,
    /// Whether a face changes, by the changes along the ring so far, the place in the ring and the face before.
    pub takes: [[[Bit; 3]; 8]; 4],
}

/// The faces that appear.
#[derive(Default)]
pub(super) struct BirthModels {
    /// The place among those that the splits suggest, for the first and the later faces of a level.
    pub place: [Number; 2],
    pub rotation: [Bit; 4],
    /// How old a corner is, where no suggestion fits.
    pub corner: Number,
}

/// The permutations.
#[derive(Default)]
pub(super) struct PermutationModels {
    pub is_there: Bit,
    pub moved: Number,
    pub gap: Number,
    /// Whether a face is the n-th suggestion, after one that was the first and after another.
    pub rank: [[Bit; SUGGESTIONS]; 2],
    pub other: Number,
}

/// How many faces are suggested for a slot at most.
pub(super) const SUGGESTIONS: usize = 24;

/// Bits of a file's payload by content, to fractions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sizes {
    /// How many vertices and faces appear at each level, and the levels' errors.
    pub levels: f64,
    /// Which vertex is replaced, and in which faces.
    pub splits: f64,
    /// Corners of the faces that appear, those of level 0 included.
    pub faces: f64,
    /// The permutations.
    pub swaps: f64,
    /// Positions, and which vertices share one.
    pub positions: f64,
    pub attributes: f64,
}

impl Sizes {
    /// Name and bits of each kind of content.
    pub fn named(&self) -> [(&'static str, f64); 6] {
        [
            ("levels", self.levels),
            ("splits", self.splits),
            ("faces", self.faces),
            ("swaps", self.swaps),
            ("positions", self.positions),
            ("attributes", self.attributes),
        ]
    }
}
