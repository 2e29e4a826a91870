//! Many instances of one mesh, each with its own slice of one index buffer.

use super::index::Index;
use super::program::Program;
use super::slices::{Slices, TooMany};
use super::touched::{DirtyBlocks, WriteObserver};
use std::ops::Range;
use std::sync::Arc;

/// Instances of one mesh. The mesh is shared. An instance has about 95 bytes of state (pm.cpu: 500 instances of about
/// 1000 faces). It also has a slice of the index buffer with its drawn faces: three indices each, plus slack (see
/// [`Slices`]).
#[derive(Clone, Debug)]
pub struct Instances<I: Index = u32> {
    program: Arc<Program>,
    levels: Vec<u32>,
    slices: Slices,
    /// All slices, used and free.
    faces: Vec<[I; 3]>,
    touched: DirtyBlocks,
    kept: Vec<[I; 3]>,
}

impl Instances {
    /// `count` instances with indices of 32 bits, all at level 0.
    ///
    /// # Errors
    /// [`TooMany`].
    pub fn new(program: Arc<Program>, count: usize) -> Result<Instances, TooMany> {
        Instances::of_width(program, count)
    }
}

impl<I: Index> Instances<I> {
    /// `count` instances, all at level 0.
    ///
    /// # Errors
    /// [`TooMany`].
    pub fn of_width(program: Arc<Program>, count: usize) -> Result<Instances<I>, TooMany> {
        let slices = Slices::new(program.faces().len() as u32);
        let (levels, faces, touched, kept) = (vec![0; count], Vec::new(), DirtyBlocks::new(0), Vec::new());
        let mut instances = Instances { program, levels, slices, faces, touched, kept };
        let live = instances.live(0);
        for instance in 0..count {
            instances.slices.push(live)?;
            instances.grow();
            instances.bring_to_life(instance, 0..live);
        }
        Ok(instances)
    }

    pub fn program(&self) -> &Program {
        &self.program
    }

    pub fn len(&self) -> usize {
        self.levels.len()
    }

    pub fn is_empty(&self) -> bool {
        self.levels.is_empty()
    }

    pub fn level(&self, instance: usize) -> u32 {
        self.levels[instance]
    }

    /// The faces that an instance draws.
    pub fn faces(&self, instance: usize) -> &[[I; 3]] {
        &self.faces[self.slots(instance)]
    }

    /// The slots of an instance's drawn faces in [`Instances::buffer`]. A draw's first index is three times
    /// the start.
    pub fn slots(&self, instance: usize) -> Range<usize> {
        let first = self.slices.first(instance) as usize;
        first..first + self.live(self.levels[instance]) as usize
    }

    /// The index buffer of all instances. It never shrinks.
    pub fn buffer(&self) -> &[[I; 3]] {
        &self.faces
    }

    /// Takes the drawn parts written since the last call: ranges of indices of [`Instances::buffer`], ascending and
    /// disjoint.
    pub fn take_touched(&mut self) -> Vec<Range<usize>> {
        let words = |slots: Range<usize>| 3 * slots.start..3 * slots.end;
        let mut live: Vec<Range<usize>> = (0..self.len()).map(|n| words(self.slots(n))).collect();
        live.sort_unstable_by_key(|words| words.start);
        common(&self.touched.take(), &live)
    }

    /// Bytes beyond the shared program and the index buffer: levels, slices, dirty flags, and scratch memory
    /// for the largest permutation so far.
    pub fn state_bytes(&self) -> usize {
        let kept = self.kept.capacity() * size_of::<[I; 3]>();
        size_of_val(&*self.levels) + self.slices.bytes() + self.touched.bytes() + kept
    }

    /// Brings an instance to a level by [`Program::change`]. The instance gets another slice if its slice is too small,
    /// or more than four times too large.
    ///
    /// # Errors
    /// [`TooMany`]; the instance stays at its level.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn go_to(&mut self, instance: usize, level: u32) -> Result<(), TooMany> {
        let before = self.levels[instance];
        let (old, new) = (self.live(before), self.live(level));
        let constructs = self.program.constructs(before, level);
        let needed = if constructs { new } else { old.max(new) };
        if constructs {
            self.fit(instance, new, 0)?;
        } else if new > old {
            self.fit(instance, new, old)?;
            self.bring_to_life(instance, old..new);
        }
        let first = self.slices.first(instance) as usize;
        let faces = &mut self.faces[first..first + needed as usize];
        let mut touch = From { touched: &mut self.touched, first };
        self.program.execute(faces, self.program.change(before, level), &mut self.kept, &mut touch);
        self.levels[instance] = level;
        if new < needed { self.fit(instance, new, new) } else { Ok(()) }
    }

    /// The faces that a level draws: the paper's `CurNumTris`, or more with births in place.
    fn live(&self, level: u32) -> u32 {
        self.program.drawn(level)
    }

    /// Fits the instance's slice to `faces` faces. The first `kept` faces are copied to a new slice.
    fn fit(&mut self, instance: usize, faces: u32, kept: u32) -> Result<(), TooMany> {
        let Some([old, new]) = self.slices.fit(instance, faces)? else { return Ok(()) };
        self.grow();
        let (old, new, kept) = (old as usize, new as usize, kept as usize);
        self.faces.copy_within(old..old + kept, new);
        self.touched.faces(new..new + kept);
        self.slices.release();
        Ok(())
    }

    fn grow(&mut self) {
        let end = self.slices.end() as usize;
        self.faces.resize(end, [I::of(0); 3]);
        self.touched.grow(end);
    }

    /// Copies faces from the shared buffer of level 0 to an instance's slice.
    fn bring_to_life(&mut self, instance: usize, slots: Range<u32>) {
        let first = self.slices.first(instance);
        let to = (first + slots.start) as usize..(first + slots.end) as usize;
        let born = &self.program.faces()[slots.start as usize..slots.end as usize];
        for (slot, face) in self.faces[to.clone()].iter_mut().zip(born) {
            *slot = face.map(I::of);
        }
        self.touched.faces(to);
    }
}

/// The intersection of two lists of ranges, each ascending and disjoint.
fn common(some: &[Range<usize>], others: &[Range<usize>]) -> Vec<Range<usize>> {
    let (mut a, mut b, mut both) = (0, 0, Vec::new());
    while let (Some(one), Some(other)) = (some.get(a), others.get(b)) {
        let range = one.start.max(other.start)..one.end.min(other.end);
        if !range.is_empty() {
            both.push(range);
        }
        if one.end < other.end { a += 1 } else { b += 1 }
    }
    both
}

/// Translates words of a slice to words of the whole buffer.
struct From<'a> {
    touched: &'a mut DirtyBlocks,
    first: usize,
}

impl WriteObserver for From<'_> {
    fn word(&mut self, word: usize) {
        self.touched.word(3 * self.first + word);
    }

    fn faces(&mut self, slots: Range<usize>) {
        self.touched.faces(self.first + slots.start..self.first + slots.end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_intersection_of_ranges_is_in_both_lists() {
        let found = common(&[0..4, 6..20, 30..31], &[2..8, 9..10, 20..25, 30..40]);
        assert_eq!(found, [2..4, 6..8, 9..10, 30..31]);
        assert_eq!(common(&[0..4, 6..8], &[]), []);
    }
}
