//! Construction of a level's index buffer in one pass over its faces (ours), for jumps over many levels.
//!
//! A split replaces corners by later vertices, and a permutation moves whole faces. Three tables therefore give every
//! level: the faces of the full mesh, the predecessor of each vertex, and the order of the faces after some of the
//! permutations, which are called keyframes. A later permutation is executed on the constructed faces.

use super::index::Index;
use std::ops::Range;

/// The tables: 12 bytes per face, 4 bytes per vertex, and 4 bytes per face that a keyframe draws. With 23 moved faces
/// per split, the tables take 60 bytes per face of the full mesh; with 10 moved faces, at most 38 bytes (pm.size).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Direct {
    /// The faces of the full mesh, each at its number: the slot in which it is first drawn.
    pub faces: Vec<[u32; 3]>,
    /// The vertex from which each vertex splits; lower than the vertex, or the vertex itself.
    pub predecessors: Vec<u32>,
    /// For each keyframe, the index of its permutation, and the end of its range of `numbers`.
    pub(super) keyframes: Vec<(usize, usize)>,
    /// For each slot that a keyframe draws, the number of its face.
    pub numbers: Vec<u32>,
}

impl Direct {
    /// The last keyframe among the first `swaps` permutations: the number of permutations up to and including this
    /// keyframe, and the keyframe's range of `numbers`. Before the first keyframe, each face lies in the slot of its
    /// number.
    pub(super) fn keyframe(&self, swaps: usize) -> (usize, Range<usize>) {
        let end = |keyframes: usize| keyframes.checked_sub(1).map_or(0, |last| self.keyframes[last].1);
        match self.keyframes.partition_point(|&(swap, _)| swap < swaps) {
            0 => (0, 0..0),
            found => (self.keyframes[found - 1].0 + 1, end(found - 1)..end(found)),
        }
    }

    /// Writes the faces of a level with `vertices` live vertices, in the order of a keyframe. These are followed by the
    /// faces that were born after the keyframe, in the order of their numbers.
    pub(super) fn construct<I: Index>(&self, faces: &mut [[I; 3]], numbers: Range<usize>, vertices: u32) {
        let numbers = &self.numbers[numbers];
        let born = numbers.len()..faces.len();
        let numbers = numbers.iter().map(|&number| number as usize).chain(born);
        for (face, number) in faces.iter_mut().zip(numbers) {
            *face = self.faces[number].map(|corner| I::of(self.live(corner, vertices)));
        }
    }

    /// The live vertex that replaces `vertex`. If level 0 has no vertices, vertex 0 is its own predecessor.
    fn live(&self, mut vertex: u32, vertices: u32) -> u32 {
        while vertex >= vertices && self.predecessors[vertex as usize] != vertex {
            vertex = self.predecessors[vertex as usize];
        }
        vertex
    }

    pub(super) fn bytes(&self) -> usize {
        let tables = size_of_val(&*self.faces) + size_of_val(&*self.keyframes);
        tables + 4 * (self.predecessors.len() + self.numbers.len())
    }
}
