//! The run-time form of a progressive mesh, shared by its instances.

use super::direct::Direct;
use super::index::Index;
use super::touched::WriteObserver;
use crate::paper::progressive_mesh::check::MeshFlaw;
use crate::paper::progressive_mesh::mesh::{Births, Level, ProgressiveMesh};
use crate::vk::IndexType;
use std::ops::Range;

/// All writes of all levels, as flat lists: 12 bytes per corner that a split writes, 4 bytes per face that a
/// permutation moves, 8 bytes per run of adjacent slots. For jumps, the tables of [`Direct`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    pub(super) levels: Vec<Level>,
    /// For each level the number of faces drawn, from the start of the index buffer. With births in place
    /// this may exceed the live faces.
    pub(super) drawn: Vec<u32>,
    /// The index buffer (the paper's F) at level 0, with the slots of all levels. A slot that level 0 does not draw
    /// holds the first face drawn in it, with the face's corners at the level at which it is first drawn.
    pub(super) faces: Vec<[u32; 3]>,
    /// For each level, the number of [`Corners`] up to and including this level.
    pub(super) corner_ends: Vec<u32>,
    pub(super) corners: Corners,
    /// Levels that carry a permutation, ascending.
    pub(super) swap_levels: Vec<u32>,
    /// For each of `swap_levels`, the number of runs, and of faces in runs, up to and including this level.
    pub(super) move_ends: Vec<[u32; 2]>,
    pub(super) moves: Moves,
    pub(super) direct: Direct,
}

/// The writes of the splits, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Corners {
    /// Word of the index buffer that holds the written corner.
    pub words: Vec<u32>,
    /// The vertex that a split writes.
    pub up: Vec<u32>,
    /// The vertex that the collapse of this split writes: `splitVert`.
    pub down: Vec<u32>,
}

/// The moves of the permutations. A permutation covers runs of adjacent slots. Going up, the faces are gathered and
/// copied back run by run; going down, the runs are copied out and their faces scattered. Half of the accesses are
/// sequential. The other accesses jump less than the accesses of cycles do, because faces that are close in one
/// cache-friendly order are close in another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moves {
    /// First slot and end of each run. The runs of one permutation ascend and do not overlap.
    pub runs: Vec<[u32; 2]>,
    /// For each slot of each run, the slot from which its face comes. A slot that only joins two runs has its own
    /// number here.
    pub from: Vec<u32>,
}

/// Maximum number of unmoved slots that join two runs: copying a face costs a fifth of starting a run.
const JOINED_SLOTS: u32 = 4;

impl Moves {
    /// Appends the permutation of some cycles.
    fn push<'a>(&mut self, cycles: impl Iterator<Item = &'a [u32]>) {
        let mut pairs = Vec::new();
        for cycle in cycles {
            let next = cycle.iter().cycle().skip(1);
            pairs.extend(cycle.iter().zip(next).map(|(&to, &from)| (to, from)));
        }
        pairs.sort_unstable();
        let first = self.runs.len();
        for (to, from) in pairs {
            match self.runs[first..].last_mut() {
                Some([_, end]) if to - *end <= JOINED_SLOTS => {
                    self.from.extend(*end..to);
                    *end = to + 1;
                }
                _ => self.runs.push([to, to + 1]),
            }
            self.from.push(from);
        }
    }
}

impl Program {
    /// Checks a progressive mesh and converts it.
    ///
    /// # Errors
    /// As [`ProgressiveMesh::check`].
    pub fn new(mesh: &ProgressiveMesh) -> Result<Program, MeshFlaw> {
        let mut program = match mesh.births {
            Births::InPlace => {
                mesh.check()?;
                Program::in_place(mesh)
            }
            Births::Tail => Program::at_the_tail(mesh)?,
        };
        program.direct = program.tables(mesh.predecessors());
        Ok(program)
    }

    fn at_the_tail(mesh: &ProgressiveMesh) -> Result<Program, MeshFlaw> {
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
        let drawn = mesh.levels.iter().map(|level| level.faces).collect();
        let (levels, faces) = (mesh.levels.clone(), mesh.faces.clone());
        let mut program = Program { levels, drawn, faces, corner_ends, corners, ..Program::default() };
        for (index, &level) in mesh.swaps.levels.iter().enumerate() {
            program.push_moves(level, mesh.swaps.cycles_of(index).map(|row| mesh.swaps.cycles.row(row)));
        }
        Ok(program)
    }

    /// Appends the permutation of a level.
    pub(super) fn push_moves<'a>(&mut self, level: u32, cycles: impl Iterator<Item = &'a [u32]>) {
        self.moves.push(cycles);
        self.swap_levels.push(level);
        self.move_ends.push([self.moves.runs.len() as u32, self.moves.from.len() as u32]);
    }

    /// n + 1 levels, coarsest first.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// n: the level of the full mesh.
    pub fn last_level(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    /// The number of faces drawn at a level, from the start of the index buffer.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn drawn(&self, level: u32) -> u32 {
        self.drawn[level as usize]
    }

    /// The index buffer at level 0, with the slots of all levels. Slots that a level does not draw have these
    /// contents.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The width of the indices of instances.
    pub fn index_type(&self) -> IndexType {
        IndexType::of_vertices(self.levels.last().map_or(0, |level| level.vertices as usize))
    }

    /// The writes of all splits.
    pub fn corners(&self) -> &Corners {
        &self.corners
    }

    /// The moves of all permutations.
    pub fn moves(&self) -> &Moves {
        &self.moves
    }

    /// Slots in the runs of the largest permutation.
    pub fn largest_move(&self) -> usize {
        (0..self.swap_levels.len()).map(|swap| self.moves_of(swap).1.len()).max().unwrap_or(0)
    }

    /// Bytes of main memory that all instances share.
    pub fn bytes(&self) -> usize {
        let levels = size_of_val(&*self.levels) + size_of_val(&*self.drawn);
        self.command_bytes() + levels + size_of_val(&*self.faces) + self.direct.bytes()
    }

    /// As [`Program::bytes`], without the levels, and with the faces of level 0 counted at the index width (16 or 32
    /// bits).
    pub fn bytes_beside_levels(&self) -> usize {
        let index_buffer = self.index_type().triangle_bytes() as usize * self.faces.len();
        self.command_bytes() + size_of_val(&*self.drawn) + index_buffer + self.direct.bytes()
    }

    /// Bytes of the lists of the steps: [`Program::bytes`] without levels, faces and the tables of [`Direct`].
    pub fn command_bytes(&self) -> usize {
        let moves = size_of_val(&*self.moves.runs) + size_of_val(&*self.moves.from);
        let words = 3 * self.corners.words.len() + self.corner_ends.len() + self.swap_levels.len();
        4 * words + size_of_val(&*self.move_ends) + moves
    }

    /// Brings the index buffer `faces` from level `from` to level `to`, step by step. `faces` must hold the drawn
    /// faces of both levels, with new faces as in [`Program::faces`]; other slots are not touched. `kept` is
    /// scratch memory for permutations.
    ///
    /// # Panics
    /// If there is no such level, or `faces` is too short.
    pub fn run<I: Index>(
        &self,
        faces: &mut [[I; 3]],
        from: u32,
        to: u32,
        kept: &mut Vec<[I; 3]>,
        touch: &mut impl WriteObserver,
    ) {
        let drawn = self.drawn(from.max(to)) as usize;
        assert!(faces.len() >= drawn, "{} faces for {drawn} drawn faces", faces.len());
        self.execute(faces, self.steps(from, to), kept, touch);
    }

    /// Executes operations in order.
    pub(super) fn execute<I: Index>(
        &self,
        faces: &mut [[I; 3]],
        operations: Vec<Operation>,
        kept: &mut Vec<[I; 3]>,
        touch: &mut impl WriteObserver,
    ) {
        for operation in operations {
            match operation {
                Operation::Construct { numbers, faces: drawn, vertices } => {
                    let drawn = drawn as usize;
                    self.direct.construct(&mut faces[..drawn], numbers, vertices);
                    touch.faces(0..drawn);
                }
                Operation::Write { corners, up } => {
                    let values = if up { &self.corners.up } else { &self.corners.down };
                    write(faces, &self.corners.words[corners.clone()], &values[corners], up, touch);
                }
                Operation::Move { runs, faces: from, up } => {
                    let (runs, from) = (&self.moves.runs[runs], &self.moves.from[from]);
                    if up {
                        gather(faces, runs, from, kept)
                    } else {
                        scatter(faces, runs, from, kept)
                    }
                    runs.iter().for_each(|&[first, end]| touch.faces(first as usize..end as usize));
                }
            }
        }
    }

    /// The steps from one level to another, in order: writes and permutations alternate.
    pub fn steps(&self, from: u32, to: u32) -> Vec<Operation> {
        let up = from < to;
        let (low, high) = (from.min(to), from.max(to));
        let [first, end] = [low, high].map(|level| self.swaps_until(level));
        let mut steps = Vec::new();
        let mut at = low;
        for swap in first..end {
            let level = self.swap_levels[swap];
            steps.push(Operation::Write { corners: self.corners_between(at, level), up });
            let (runs, faces) = self.moves_of(swap);
            steps.push(Operation::Move { runs, faces, up });
            at = level;
        }
        steps.push(Operation::Write { corners: self.corners_between(at, high), up });
        if !up {
            steps.reverse();
        }
        steps
    }

    /// The number of permutations up to and including a level.
    pub(super) fn swaps_until(&self, level: u32) -> usize {
        self.swap_levels.partition_point(|&swap| swap <= level)
    }

    /// The ranges of [`Moves`] of one permutation.
    pub(super) fn moves_of(&self, swap: usize) -> (Range<usize>, Range<usize>) {
        let start = if swap == 0 { [0; 2] } else { self.move_ends[swap - 1] };
        let [runs, faces] = [0, 1].map(|n| start[n] as usize..self.move_ends[swap][n] as usize);
        (runs, faces)
    }

    pub(super) fn corners_between(&self, low: u32, high: u32) -> Range<usize> {
        self.corner_ends[low as usize] as usize..self.corner_ends[high as usize] as usize
    }
}

/// A step from one level to another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Operation {
    /// The writes of a range of [`Corners`]: in order for splits, in the opposite order for collapses.
    Write { corners: Range<usize>, up: bool },
    /// The permutation of a range of runs and their slots; going down, its inverse.
    Move { runs: Range<usize>, faces: Range<usize>, up: bool },
    /// The first `faces` slots, from the tables of [`Direct`] with a keyframe's `numbers`, for a level with `vertices`
    /// live vertices.
    Construct { numbers: Range<usize>, faces: u32, vertices: u32 },
}

fn write<I: Index>(
    faces: &mut [[I; 3]],
    words: &[u32],
    values: &[u32],
    up: bool,
    touch: &mut impl WriteObserver,
) {
    let flat = faces.as_flattened_mut();
    let mut one = |(&word, &value): (&u32, &u32)| {
        flat[word as usize] = I::of(value);
        touch.word(word as usize);
    };
    let pairs = words.iter().zip(values);
    if up { pairs.for_each(&mut one) } else { pairs.rev().for_each(&mut one) }
}

pub(super) fn gather<T: Copy>(faces: &mut [T], runs: &[[u32; 2]], from: &[u32], kept: &mut Vec<T>) {
    kept.clear();
    kept.extend(from.iter().map(|&slot| faces[slot as usize]));
    let mut rest = &**kept;
    for &[first, end] in runs {
        let run = &mut faces[first as usize..end as usize];
        let (here, others) = rest.split_at(run.len());
        run.copy_from_slice(here);
        rest = others;
    }
}

fn scatter<I: Index>(faces: &mut [[I; 3]], runs: &[[u32; 2]], from: &[u32], kept: &mut Vec<[I; 3]>) {
    kept.clear();
    runs.iter().for_each(|&[first, end]| kept.extend_from_slice(&faces[first as usize..end as usize]));
    for (&slot, &face) in from.iter().zip(&*kept) {
        faces[slot as usize] = face;
    }
}
