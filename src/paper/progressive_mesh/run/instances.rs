//! Many instances of one mesh, each with its own slice of one index buffer.

use super::program::Program;
use super::touched::{Touch, Touched};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Instances of one mesh. The mesh is shared; an instance has 12 bytes of state, and a slice of the index buffer that holds
/// its live faces: 12 bytes each, and at most a quarter more, for slices come in few sizes and are used again.
#[derive(Clone, Debug)]
pub struct Instances {
    program: Arc<Program>,
    states: Vec<Slice>,
    /// All slices, those in use and those that are free.
    faces: Vec<[u32; 3]>,
    /// First faces of free slices, by their size.
    free: BTreeMap<u32, Vec<u32>>,
    touched: Touched,
    kept: Vec<[u32; 3]>,
}

#[derive(Clone, Copy, Debug)]
struct Slice {
    level: u32,
    first: u32,
    size: u32,
}

/// The size of a slice that is to hold so many faces: 64, 80, 96, 112, 128, 160 …, but never more than `most`.
fn size_for(faces: u32, most: u32) -> u32 {
    let octave = faces.max(64).ilog2();
    faces.max(64).next_multiple_of(1 << (octave - 2)).min(most)
}

impl Instances {
    /// So many instances, all at level 0.
    pub fn new(program: Arc<Program>, count: usize) -> Instances {
        let mut instances = Instances {
            program,
            states: Vec::with_capacity(count),
            faces: Vec::new(),
            free: BTreeMap::new(),
            touched: Touched::new(0),
            kept: Vec::new(),
        };
        for _ in 0..count {
            let live = instances.live(0);
            let size = size_for(live, instances.program.faces().len() as u32);
            let first = instances.take_slice(size);
            instances.states.push(Slice { level: 0, first, size });
            instances.bring_to_life(first, 0..live);
        }
        instances
    }

    pub fn program(&self) -> &Program {
        &self.program
    }

    pub fn len(&self) -> usize {
        self.states.len()
    }

    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }

    pub fn level(&self, instance: usize) -> u32 {
        self.states[instance].level
    }

    /// The live faces of an instance.
    pub fn faces(&self, instance: usize) -> &[[u32; 3]] {
        &self.faces[self.slots(instance)]
    }

    /// Where they stand in [`Instances::buffer`]: a draw's first index is three times the start.
    pub fn slots(&self, instance: usize) -> Range<usize> {
        let Slice { level, first, .. } = self.states[instance];
        first as usize..(first + self.live(level)) as usize
    }

    /// The index buffer of all instances. It only ever grows.
    pub fn buffer(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// What was written since the last call: ranges of words of [`Instances::buffer`], ascending and apart.
    pub fn take_touched(&mut self) -> Vec<Range<usize>> {
        self.touched.take()
    }

    /// Bytes besides the shared program and the index buffer: state, lists of free slices, marks of what was written,
    /// and memory for the largest permutation so far.
    pub fn state_bytes(&self) -> usize {
        let free: usize = self.free.values().map(|firsts| size_of_val(&**firsts)).sum();
        size_of_val(&*self.states) + free + self.touched.bytes() + 12 * self.kept.capacity()
    }

    /// Brings an instance to a level: executes what lies between. It moves to another slice where its own is too small,
    /// or more than four times too large.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn go_to(&mut self, instance: usize, level: u32) {
        let before = self.states[instance].level;
        let (old, new) = (self.live(before), self.live(level));
        if new > old {
            let first = self.fit(instance, new);
            self.bring_to_life(first, old..new);
        }
        let Slice { first, size, .. } = self.states[instance];
        let faces = &mut self.faces[first as usize..(first + size) as usize];
        let mut touch = From { touched: &mut self.touched, first: first as usize };
        self.program.run(faces, before, level, &mut self.kept, &mut touch);
        self.states[instance].level = level;
        if new < old {
            self.fit(instance, new);
        }
    }

    /// `CurNumTris` of a level.
    fn live(&self, level: u32) -> u32 {
        self.program.levels()[level as usize].faces
    }

    /// Gives an instance a slice for so many faces, where its own is of another size, and returns where it begins.
    /// Faces that fit move along.
    fn fit(&mut self, instance: usize, faces: u32) -> u32 {
        let Slice { first, size, level } = self.states[instance];
        let wanted = size_for(faces, self.program.faces().len() as u32);
        if wanted == size || (wanted < size && 4 * wanted >= size) {
            return first;
        }
        let new = self.take_slice(wanted);
        let moved = faces.min(self.live(level)) as usize;
        self.faces.copy_within(first as usize..first as usize + moved, new as usize);
        self.touched.faces(new as usize..new as usize + moved);
        self.free.entry(size).or_default().push(first);
        self.states[instance] = Slice { first: new, size: wanted, level };
        new
    }

    fn take_slice(&mut self, size: u32) -> u32 {
        if let Some(first) = self.free.get_mut(&size).and_then(Vec::pop) {
            return first;
        }
        let first = u32::try_from(self.faces.len()).expect("fewer than 2^32 faces in all instances");
        let end = self.faces.len() + size as usize;
        assert!(end <= u32::MAX as usize / 3, "{end} faces: their words need more than 32 bits");
        self.faces.resize(end, [0; 3]);
        self.touched.grow(end);
        first
    }

    /// Copies faces from M0's buffer to the slice that begins at `first`.
    fn bring_to_life(&mut self, first: u32, slots: Range<u32>) {
        let to = (first + slots.start) as usize..(first + slots.end) as usize;
        self.faces[to.clone()]
            .copy_from_slice(&self.program.faces()[slots.start as usize..slots.end as usize]);
        self.touched.faces(to);
    }
}

/// Words of a slice as words of the whole buffer.
struct From<'a> {
    touched: &'a mut Touched,
    first: usize,
}

impl Touch for From<'_> {
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
    fn a_slice_is_at_most_a_quarter_too_large() {
        for faces in 64..5000 {
            let size = size_for(faces, u32::MAX);
            assert!(faces <= size && 4 * size < 5 * faces, "{faces} faces in {size}");
            assert_eq!(size_for(size, u32::MAX), size);
        }
        assert_eq!([1, 65, 81, 129].map(|faces| size_for(faces, 1000)), [64, 80, 96, 160]);
        assert_eq!(size_for(900, 1000), 1000.min(size_for(900, u32::MAX)));
    }
}
