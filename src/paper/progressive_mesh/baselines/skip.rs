//! One skip list (T. Forsyth, "Comparison of VIPM Methods", Game Programming Gems 2, 2001). While a level change stays
//! within a list, it writes the changed corners, including corners of degenerate faces.

use crate::math::ragged::Ragged;
use crate::paper::progressive_mesh::mesh::{Level, NOWHERE, ProgressiveMesh};
use crate::paper::progressive_mesh::run::WriteObserver;

/// The faces of a level in meshoptimizer's order. The list also serves coarser levels, at which some faces
/// are degenerate.
pub struct SkipList {
    /// The coarsest and the finest level that this list serves.
    pub levels: [u32; 2],
    /// The faces at the finest level.
    pub faces: Vec<[u32; 3]>,
    /// Vertices that are live at all levels of the list.
    kept_vertices: u32,
    /// For each other vertex, the words of the list that contain it while it is live.
    words: Ragged<u32>,
    /// For each such vertex, the value of these words while the vertex is live, and their value while it is not live.
    values: Vec<[u32; 2]>,
}

impl SkipList {
    /// Builds a list from the faces of the finest level. `space[v]` is the index that
    /// represents vertex v: v itself, or the first vertex at its position.
    pub fn new(mesh: &ProgressiveMesh, space: &[u32], levels: [u32; 2], faces: Vec<[u32; 3]>) -> SkipList {
        let [kept_vertices, end] = levels.map(|level| mesh.levels[level as usize].vertices);
        let mut rows = vec![Vec::new(); (end - kept_vertices) as usize];
        let replaced = |vertex: u32| mesh.splits.split_vertices[(vertex - mesh.levels[0].vertices) as usize];
        for (word, &vertex) in faces.as_flattened().iter().enumerate() {
            let mut vertex = vertex;
            while vertex >= kept_vertices && vertex != NOWHERE {
                rows[(vertex - kept_vertices) as usize].push(word as u32);
                vertex = replaced(vertex);
            }
        }
        let values = |vertex: u32| {
            let without = match replaced(vertex) {
                // A component that has not appeared yet collapses to vertex 0: its faces are degenerate.
                NOWHERE => 0,
                other => space[other as usize],
            };
            [space[vertex as usize], without]
        };
        let values = (kept_vertices..end).map(values).collect();
        SkipList { levels, faces, kept_vertices, words: rows.into_iter().collect(), values }
    }

    /// True if this list serves a level.
    pub fn serves(&self, level: u32) -> bool {
        (self.levels[0]..=self.levels[1]).contains(&level)
    }

    /// Brings `faces`, which is this list at level `from`, to level `to`. Returns the number of corners
    /// written.
    ///
    /// # Panics
    /// If the list does not serve one of the levels.
    pub fn run(
        &self,
        levels: &[Level],
        faces: &mut [[u32; 3]],
        [from, to]: [u32; 2],
        touch: &mut impl WriteObserver,
    ) -> usize {
        let (flat, mut written) = (faces.as_flattened_mut(), 0);
        let mut write = |row: usize, value: u32| {
            for &word in self.words.row(row) {
                flat[word as usize] = value;
                touch.word(word as usize);
            }
            written += self.words.row(row).len();
        };
        let row = |level: u32| (levels[level as usize].vertices - self.kept_vertices) as usize;
        match from < to {
            true => (row(from)..row(to)).for_each(|row| write(row, self.values[row][0])),
            false => (row(to)..row(from)).rev().for_each(|row| write(row, self.values[row][1])),
        }
        written
    }

    /// Bytes of the commands of level changes (words to write and their values): the list's memory without its faces.
    pub fn command_bytes(&self) -> usize {
        self.words.bytes() + size_of_val(&*self.values)
    }
}
