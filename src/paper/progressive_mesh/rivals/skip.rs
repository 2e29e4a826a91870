//! One of several skip lists (Forsyth 2001): between the levels at which lists are exchanged, a change of level writes
//! the corners that it changes, those of faces without area too.

use crate::math::ragged::Ragged;
use crate::paper::progressive_mesh::mesh::{Level, NOWHERE, ProgressiveMesh};
use crate::paper::progressive_mesh::run::Touch;

/// The faces of a level in their best order, for that level and coarser ones.
pub struct SkipList {
    /// The coarsest and the finest level that it serves.
    pub levels: [u32; 2],
    /// As they are at the finest.
    pub faces: Vec<[u32; 3]>,
    /// Vertices that all its levels have.
    kept_vertices: u32,
    /// For each other vertex the words of the list in which it stands while it lives.
    words: Ragged<u32>,
    /// And what stands there with it, and without.
    values: Vec<[u32; 2]>,
}

impl SkipList {
    /// Of the faces of the finest of its levels; `space` tells the index that stands for each vertex.
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
                // A component that is not there yet stands at the first vertex, and has no area.
                NOWHERE => 0,
                other => space[other as usize],
            };
            [space[vertex as usize], without]
        };
        let values = (kept_vertices..end).map(values).collect();
        SkipList { levels, faces, kept_vertices, words: rows.into_iter().collect(), values }
    }

    /// Whether it serves a level.
    pub fn serves(&self, level: u32) -> bool {
        (self.levels[0]..=self.levels[1]).contains(&level)
    }

    /// Brings `faces`, which is this list at level `from`, to level `to`; returns how many corners it writes.
    ///
    /// # Panics
    /// If it does not serve one of them.
    pub fn run(
        &self,
        levels: &[Level],
        faces: &mut [[u32; 3]],
        [from, to]: [u32; 2],
        touch: &mut impl Touch,
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

    /// Bytes of main memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.faces) + self.words.bytes() + size_of_val(&*self.values)
    }
}
