//! The adaptive models for writing and reading, and the size of each kind of content.

use super::coder::{Bit, Number};

/// One model for each kind of symbol. They adapt from chunk to chunk, so a chunk can only be read after all
/// chunks before it.
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

/// The replaced vertex, and the faces in which it is replaced.
#[derive(Default)]
pub(super) struct SplitModels {
    pub nowhere: Bit,
    /// True if the replaced vertex is a neighbour of the previous vertex. `neighbour` then codes its index among the
    /// neighbours.
    pub near: Bit,
    pub neighbour: Number,
    /// The age of the replaced vertex, if it is not a neighbour.
    pub age: Number,
    /// Whether a face changes. The model depends on the changes along the ring so far, the index in the ring, and
    /// the previous face.
    pub takes: [[[Bit; 3]; 8]; 4],
}

/// New faces.
#[derive(Default)]
pub(super) struct BirthModels {
    /// The index among the suggestions, for the first and for the later faces of a level.
    pub place: [Number; 2],
    pub rotation: [Bit; 4],
    /// The age of a corner, if no suggestion fits.
    pub corner: Number,
}

/// The permutations.
#[derive(Default)]
pub(super) struct PermutationModels {
    pub is_there: Bit,
    pub moved: Number,
    pub gap: Number,
    /// Bit n: the face is suggestion n. Set 1 is for the first slot of a permutation and for slots whose preceding slot
    /// got its first suggestion, set 0 for all others.
    pub rank: [[Bit; SUGGESTIONS]; 2],
    pub other: Number,
}

/// Maximum number of suggestions for a slot.
pub(super) const SUGGESTIONS: usize = 24;

/// Bits of a file's payload by content, including fractions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sizes {
    /// The numbers of new vertices and faces at each level, and the errors.
    pub levels: f64,
    /// The replaced vertices, and the faces in which they are replaced.
    pub splits: f64,
    /// Corners of new faces, including level 0's.
    pub faces: f64,
    /// The permutations.
    pub swaps: f64,
    /// Positions, and which vertices share a position.
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
