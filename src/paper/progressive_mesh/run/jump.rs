//! The cheapest way to a level: step by step, or its construction from the tables of [`Direct`] (ours).

use super::direct::Direct;
use super::program::{Operation, Program, gather};
use super::touched::IgnoreWrites;

impl Program {
    /// Builds the tables from which levels are constructed. A permutation becomes a keyframe if the permutations after
    /// the last keyframe, up to and including this one, move at least half of the faces that its level draws. So the
    /// keyframes have at most twice as many entries as the permutations. After a construction, the permutations that
    /// are still to be executed move less than half of the faces.
    pub(super) fn tables(&self, predecessors: Vec<u32>) -> Direct {
        let mut direct = Direct { predecessors, ..Direct::default() };
        let mut numbers: Vec<u32> = (0..self.faces.len() as u32).collect();
        let (mut moved, mut kept) = (0, Vec::new());
        for (swap, &level) in self.swap_levels.iter().enumerate() {
            let (runs, from) = self.moves_of(swap);
            moved += from.len();
            gather(&mut numbers, &self.moves.runs[runs], &self.moves.from[from], &mut kept);
            let drawn = self.drawn(level) as usize;
            if 2 * moved >= drawn {
                direct.numbers.extend(&numbers[..drawn]);
                direct.keyframes.push((swap, direct.numbers.len()));
                moved = 0;
            }
        }
        let mut whole = self.faces.clone();
        self.run(&mut whole, 0, self.last_level(), &mut Vec::new(), &mut IgnoreWrites);
        direct.faces = vec![[0; 3]; whole.len()];
        for (&number, face) in numbers.iter().zip(whole) {
            direct.faces[number as usize] = face;
        }
        direct
    }

    /// The tables from which levels are constructed.
    pub fn direct(&self) -> &Direct {
        &self.direct
    }

    /// The operations that bring an index buffer from one level to another. There are two ways: [`Program::steps`], or
    /// a construction followed by the permutations since the construction's keyframe. The way that writes fewer indices
    /// is taken.
    pub fn change(&self, from: u32, to: u32) -> Vec<Operation> {
        if !self.constructs(from, to) {
            return self.steps(from, to);
        }
        let swaps = self.swaps_until(to);
        let (done, numbers) = self.direct.keyframe(swaps);
        let vertices = self.levels[to as usize].vertices;
        let construct = Operation::Construct { numbers, faces: self.drawn(to), vertices };
        let since = (done..swaps).map(|swap| {
            let (runs, faces) = self.moves_of(swap);
            Operation::Move { runs, faces, up: true }
        });
        std::iter::once(construct).chain(since).collect()
    }

    /// True if [`Program::change`] constructs the level. A construction reads no current face, and writes all faces
    /// that the level draws.
    pub fn constructs(&self, from: u32, to: u32) -> bool {
        let [low, high] = [from.min(to), from.max(to)];
        let born = u64::from(self.drawn(to).saturating_sub(self.drawn(from)));
        let [before, after] = [low, high].map(|level| self.swaps_until(level));
        let steps = self.corners_between(low, high).len() as u64 + 3 * (self.moved(before, after) + born);
        let swaps = self.swaps_until(to);
        let (done, _) = self.direct.keyframe(swaps);
        3 * (u64::from(self.drawn(to)) + self.moved(done, swaps)) < steps
    }

    /// Faces that a range of permutations moves.
    fn moved(&self, first: usize, end: usize) -> u64 {
        let until = |swaps: usize| swaps.checked_sub(1).map_or(0, |last| self.move_ends[last][1]);
        u64::from(until(end) - until(first))
    }
}
