//! Keyframes (ours): F at some levels. A jump over many levels starts from one of them instead of executing every
//! permutation on its way, so it writes little more than a copy of its faces.

use super::index::Index;
use super::program::Program;
use super::touched::{Touch, Untold};
use crate::vk::IndexType;

/// A keyframe has at least this many times the faces of the one before, and the last is at the last permutation: all
/// together take at most twice the memory of the full mesh's faces.
const GROWTH: u32 = 2;

/// The drawn faces at a level.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Keyframe {
    level: u32,
    faces: Stored,
}

#[derive(Clone, Debug, PartialEq)]
enum Stored {
    Narrow(Vec<[u16; 3]>),
    Wide(Vec<[u32; 3]>),
}

impl Keyframe {
    pub fn bytes(&self) -> usize {
        match &self.faces {
            Stored::Narrow(faces) => size_of_val(&**faces),
            Stored::Wide(faces) => size_of_val(&**faces),
        }
    }
}

fn copy<From: Index, To: Index>(from: &[[From; 3]], to: &mut [[To; 3]]) {
    for (slot, face) in to.iter_mut().zip(from) {
        *slot = face.map(|index| To::of(index.vertex()));
    }
}

impl Program {
    /// Stores the keyframes, just after permutations.
    pub(super) fn with_keyframes(mut self) -> Program {
        let (mut levels, mut most) = (Vec::new(), u32::MAX);
        for &level in self.swap_levels.iter().rev().filter(|&&level| self.drawn(level) > 0) {
            if self.drawn(level) <= most {
                levels.push(level);
                most = self.drawn(level) / GROWTH;
            }
        }
        let (mut faces, mut kept, mut at) = (self.faces.clone(), Vec::new(), 0);
        for level in levels.into_iter().rev() {
            self.execute(&mut faces, at, level, &mut kept, &mut Untold);
            at = level;
            let live = &faces[..self.drawn(level) as usize];
            let faces = match self.index_type() {
                IndexType::U16 => Stored::Narrow(live.iter().map(|face| face.map(u16::of)).collect()),
                IndexType::U32 => Stored::Wide(live.to_vec()),
            };
            self.keyframes.push(Keyframe { level, faces });
        }
        self
    }

    /// The levels of the keyframes, and their drawn faces one after another.
    pub fn keyframes(&self) -> impl Iterator<Item = (u32, Vec<[u32; 3]>)> {
        self.keyframes.iter().map(|keyframe| {
            let mut faces = vec![[0; 3]; self.drawn(keyframe.level) as usize];
            keyframe.copy_to(&mut faces);
            (keyframe.level, faces)
        })
    }

    /// The keyframe from which a jump writes least; `None` if executing every step writes less.
    pub fn route(&self, from: u32, to: u32) -> Option<usize> {
        let most = from.max(to);
        let direct = self.executed(from, to) + 3 * u64::from(self.drawn(to).saturating_sub(self.drawn(from)));
        let after = self.keyframes.partition_point(|keyframe| keyframe.level <= to);
        let near = after.saturating_sub(1)..(after + 1).min(self.keyframes.len());
        let possible = near.filter(|&n| self.keyframes[n].level <= most);
        let best = possible.map(|n| (self.written_from(n, from, to), n)).min()?;
        (best.0 < direct).then_some(best.1)
    }

    /// Indices that a change of level writes, faces that come to life included.
    pub fn written(&self, from: u32, to: u32) -> u64 {
        match self.route(from, to) {
            Some(keyframe) => self.written_from(keyframe, from, to),
            None => self.executed(from, to) + 3 * u64::from(self.drawn(to).saturating_sub(self.drawn(from))),
        }
    }

    fn written_from(&self, keyframe: usize, from: u32, to: u32) -> u64 {
        3 * u64::from(self.drawn(from.max(to))) + self.executed(self.keyframes[keyframe].level, to)
    }

    /// Brings `faces`, at any level, to a keyframe's; returns its level.
    pub(super) fn restore<I: Index>(
        &self,
        keyframe: usize,
        faces: &mut [[I; 3]],
        touch: &mut impl Touch,
    ) -> u32 {
        let keyframe = &self.keyframes[keyframe];
        let (drawn, others) = faces.split_at_mut(self.drawn(keyframe.level) as usize);
        keyframe.copy_to(drawn);
        copy(&self.faces[drawn.len()..], others);
        touch.faces(0..faces.len());
        keyframe.level
    }
}

impl Keyframe {
    fn copy_to<I: Index>(&self, to: &mut [[I; 3]]) {
        match &self.faces {
            Stored::Narrow(faces) => copy(faces, to),
            Stored::Wide(faces) => copy(faces, to),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
    use crate::paper::progressive_mesh::order::{OrderOptions, order, scratch};

    fn meshes() -> [ProgressiveMesh; 2] {
        let model = scratch::torus(32);
        let collapses = scratch::collapses(&model, 64);
        [OrderOptions::TAIL_23, OrderOptions::IN_PLACE_23]
            .map(|options| order(&model, &collapses, &options, &mut |_, _| {}))
    }

    /// Pairs of levels, each other distance once.
    fn jumps(last: u32) -> impl Iterator<Item = [u32; 2]> {
        (0..last).map(move |n| [(n * 7919) % (last + 1), (n * 104_729 + last / 3) % (last + 1)])
    }

    #[test]
    fn a_jump_from_a_keyframe_comes_to_the_same_bits_as_every_step() {
        for mesh in meshes() {
            let program = Program::new(&mesh).unwrap();
            let narrow: Vec<[u16; 3]> = program.faces().iter().map(|face| face.map(u16::of)).collect();
            let (mut run, mut executed, mut at) = (narrow, program.faces().to_vec(), 0);
            let mut routed = 0;
            for [_, to] in jumps(program.last_level()) {
                routed += u32::from(program.route(at, to).is_some());
                program.run(&mut run, at, to, &mut Vec::new(), &mut Untold);
                program.execute(&mut executed, at, to, &mut Vec::new(), &mut Untold);
                at = to;
                assert!(
                    run.as_flattened()
                        .iter()
                        .map(|&index| u32::from(index))
                        .eq(executed.as_flattened().iter().copied())
                );
            }
            assert!(routed > program.last_level() / 3, "{routed}");
        }
    }

    #[test]
    fn a_jump_writes_at_most_a_few_copies_and_never_more_than_every_step() {
        for mesh in meshes() {
            let program = Program::new(&mesh).unwrap();
            let last = program.last_level();
            let copy = |level: u32| 3.0 * f64::from(program.drawn(level));
            for [from, to] in jumps(last) {
                let (written, most) = (program.written(from, to), from.max(to));
                let born = 3 * u64::from(program.drawn(to).saturating_sub(program.drawn(from)));
                assert!(written <= program.executed(from, to) + born);
                assert!((written as f64) < 7.5 * copy(most), "{from} to {to}: {written}");
            }
            assert!(program.written(0, last) as f64 * 4.0 < program.executed(0, last) as f64);
            // The keyframes' own faces: less than twice the full mesh's.
            let kept: usize = program.keyframes.iter().map(Keyframe::bytes).sum();
            assert!(kept < 2 * 6 * mesh.faces.len(), "{kept}");
        }
    }
}
