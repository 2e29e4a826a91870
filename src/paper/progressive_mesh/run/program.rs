//! The run-time form of a progressive mesh, shared by its instances.

use super::touched::Touch;
use crate::paper::progressive_mesh::check::Flaw;
use crate::paper::progressive_mesh::mesh::{Level, ProgressiveMesh};
use std::ops::Range;

/// All writes of all levels, as flat lists: 12 bytes for each corner that a split writes, 8 for each face that a
/// permutation moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    levels: Vec<Level>,
    /// F at level 0, all slots: what a face is when it comes to life.
    faces: Vec<[u32; 3]>,
    /// For each level the number of [`Corners`] that lead to it and to all below.
    corner_ends: Vec<u32>,
    corners: Corners,
    /// Levels that carry a permutation, ascending.
    swap_levels: Vec<u32>,
    /// For each of them the number of moved faces of it and of all before it.
    move_ends: Vec<u32>,
    moves: Moves,
}

/// What the splits write, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Corners {
    /// Index into F as a flat list of words.
    pub words: Vec<u32>,
    /// The vertex that a split writes there.
    pub up: Vec<u32>,
    /// The vertex that its collapse writes there: `splitVert`.
    pub down: Vec<u32>,
}

/// What the permutations move: those of one level ascending by `to`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moves {
    /// Slots that are filled going up.
    pub to: Vec<u32>,
    /// Where their faces come from.
    pub from: Vec<u32>,
}

impl Program {
    /// Checks a progressive mesh, and packs it.
    ///
    /// # Errors
    /// As [`ProgressiveMesh::check`].
    pub fn new(mesh: &ProgressiveMesh) -> Result<Program, Flaw> {
        let mut corners = Corners::default();
        mesh.walk(|(word, up, down)| {
            corners.words.push(word);
            corners.up.push(up);
            corners.down.push(down);
        })?;
        let (mut corner_ends, mut end, mut row) = (vec![0], 0, 0);
        for pair in mesh.levels.windows(2) {
            for _ in pair[0].vertices..pair[1].vertices {
                end += mesh.splits.slots.row(row).len() as u32;
                row += 1;
            }
            corner_ends.push(end);
        }
        let (mut moves, mut move_ends) = (Moves::default(), Vec::new());
        for index in 0..mesh.swaps.levels.len() {
            let mut pairs = Vec::new();
            for cycle in mesh.swaps.cycles_of(index).map(|row| mesh.swaps.cycles.row(row)) {
                let next = cycle.iter().cycle().skip(1);
                pairs.extend(cycle.iter().zip(next).map(|(&to, &from)| (to, from)));
            }
            pairs.sort_unstable();
            moves.to.extend(pairs.iter().map(|&(to, _)| to));
            moves.from.extend(pairs.iter().map(|&(_, from)| from));
            move_ends.push(moves.to.len() as u32);
        }
        let (levels, faces) = (mesh.levels.clone(), mesh.faces.clone());
        Ok(Program {
            levels,
            faces,
            corner_ends,
            corners,
            swap_levels: mesh.swaps.levels.clone(),
            move_ends,
            moves,
        })
    }

    /// n + 1 levels, coarsest first.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// n: the level of the full mesh.
    pub fn last_level(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    /// F at level 0, all slots. A face that is not live at a level is as it is here.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// What all splits write.
    pub fn corners(&self) -> &Corners {
        &self.corners
    }

    /// What all permutations move.
    pub fn moves(&self) -> &Moves {
        &self.moves
    }

    /// Faces of the largest permutation.
    pub fn largest_move(&self) -> usize {
        let starts = [0].iter().chain(&self.move_ends);
        self.move_ends.iter().zip(starts).map(|(end, start)| (end - start) as usize).max().unwrap_or(0)
    }

    /// Bytes of main memory that all instances share.
    pub fn bytes(&self) -> usize {
        let words = 3 * self.corners.words.len() + 2 * self.moves.to.len();
        let ends = self.corner_ends.len() + self.swap_levels.len() + self.move_ends.len();
        4 * (words + ends) + size_of_val(&*self.levels) + size_of_val(&*self.faces)
    }

    /// Brings `faces`, which is F at level `from`, to level `to`. It must hold the live faces of both levels, those that
    /// come to life as they are in [`Program::faces`]; what else it holds stays. `kept` is memory for permutations.
    ///
    /// # Panics
    /// If there is no such level, or `faces` is too short.
    pub fn run(
        &self,
        faces: &mut [[u32; 3]],
        from: u32,
        to: u32,
        kept: &mut Vec<[u32; 3]>,
        touch: &mut impl Touch,
    ) {
        let live = self.levels[from.max(to) as usize].faces as usize;
        assert!(faces.len() >= live, "{} faces of {live} live ones", faces.len());
        for step in self.steps(from, to) {
            match step {
                Step::Write { corners, up } => {
                    let values = if up { &self.corners.up } else { &self.corners.down };
                    write(faces, &self.corners.words[corners.clone()], &values[corners], up, touch);
                }
                Step::Move { faces: moved, up } => {
                    let (to, from) = (&self.moves.to[moved.clone()], &self.moves.from[moved]);
                    let (to, from) = if up { (to, from) } else { (from, to) };
                    kept.clear();
                    kept.extend(from.iter().map(|&slot| faces[slot as usize]));
                    for (&slot, &face) in to.iter().zip(&*kept) {
                        faces[slot as usize] = face;
                        touch.face(slot as usize);
                    }
                }
            }
        }
    }

    /// What leads from one level to another, in order: writes and permutations in turn.
    pub fn steps(&self, from: u32, to: u32) -> Vec<Step> {
        let up = from < to;
        let (low, high) = (from.min(to), from.max(to));
        let [first, end] = [low, high].map(|level| self.swap_levels.partition_point(|&swap| swap <= level));
        let mut steps = Vec::new();
        let mut at = low;
        for swap in first..end {
            let level = self.swap_levels[swap];
            steps.push(Step::Write { corners: self.corners_between(at, level), up });
            let start = if swap == 0 { 0 } else { self.move_ends[swap - 1] };
            steps.push(Step::Move { faces: start as usize..self.move_ends[swap] as usize, up });
            at = level;
        }
        steps.push(Step::Write { corners: self.corners_between(at, high), up });
        if !up {
            steps.reverse();
        }
        steps
    }

    fn corners_between(&self, low: u32, high: u32) -> Range<usize> {
        self.corner_ends[low as usize] as usize..self.corner_ends[high as usize] as usize
    }
}

/// A part of what leads from one level to another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// The splits of a range of [`Corners`], in order; going down their collapses, in the opposite order.
    Write { corners: Range<usize>, up: bool },
    /// The permutation of a range of [`Moves`]; going down its inverse.
    Move { faces: Range<usize>, up: bool },
}

impl Step {
    /// Faces that must be kept while the step runs.
    pub fn kept_faces(&self) -> usize {
        match self {
            Step::Write { .. } => 0,
            Step::Move { faces, .. } => faces.len(),
        }
    }
}

fn write(faces: &mut [[u32; 3]], words: &[u32], values: &[u32], up: bool, touch: &mut impl Touch) {
    let flat = faces.as_flattened_mut();
    let mut one = |(&word, &value): (&u32, &u32)| {
        flat[word as usize] = value;
        touch.word(word as usize);
    };
    let pairs = words.iter().zip(values);
    if up { pairs.for_each(&mut one) } else { pairs.rev().for_each(&mut one) }
}
