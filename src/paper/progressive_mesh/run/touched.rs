//! Tracks the parts of an index buffer that were written and must be uploaded.

use std::ops::Range;

/// Observer of writes.
pub trait WriteObserver {
    /// One word of the index buffer was written.
    fn word(&mut self, word: usize);
    /// Faces in adjacent slots were written.
    fn faces(&mut self, slots: Range<usize>);
}

/// Ignores all writes. For index buffers that need no upload.
pub struct IgnoreWrites;

impl WriteObserver for IgnoreWrites {
    fn word(&mut self, _: usize) {}
    fn faces(&mut self, _: Range<usize>) {}
}

/// Unit of upload: 128 indices, 256 or 512 bytes. Blocks of 64 bytes mean many more copies; blocks of 4 KiB carry
/// several times the written bytes.
pub const BLOCK_WORDS: usize = 1 << BLOCK_LOG2;
const BLOCK_LOG2: u32 = 7;

/// Blocks of an index buffer that were written since the last [`DirtyBlocks::take`].
#[derive(Clone, Debug)]
pub struct DirtyBlocks {
    /// One byte per block, because a bit would need a read before each write.
    dirty: Vec<bool>,
    words: usize,
}

impl DirtyBlocks {
    /// The blocks of an index buffer of `faces` faces; none is written yet.
    pub fn new(faces: usize) -> DirtyBlocks {
        let words = 3 * faces;
        DirtyBlocks { dirty: vec![false; words.div_ceil(BLOCK_WORDS)], words }
    }

    /// The buffer grew; its new part counts as unwritten.
    pub fn grow(&mut self, faces: usize) {
        self.words = self.words.max(3 * faces);
        self.dirty.resize(self.words.div_ceil(BLOCK_WORDS), false);
    }

    /// Bytes of main memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.dirty)
    }

    /// Marks the faces of these slots as written.
    pub fn faces(&mut self, slots: Range<usize>) {
        if !slots.is_empty() {
            let (first, last) = (3 * slots.start, 3 * slots.end - 1);
            self.dirty[first >> BLOCK_LOG2..=last >> BLOCK_LOG2].fill(true);
        }
    }

    /// Takes the ranges of words that cover all writes, ascending and disjoint.
    pub fn take(&mut self) -> Vec<Range<usize>> {
        let mut ranges: Vec<Range<usize>> = Vec::new();
        for (block, dirty) in self.dirty.iter_mut().enumerate() {
            if std::mem::take(dirty) {
                let words = block * BLOCK_WORDS..((block + 1) * BLOCK_WORDS).min(self.words);
                match ranges.last_mut() {
                    Some(last) if last.end == words.start => last.end = words.end,
                    _ => ranges.push(words),
                }
            }
        }
        ranges
    }
}

impl WriteObserver for DirtyBlocks {
    fn word(&mut self, word: usize) {
        self.dirty[word >> BLOCK_LOG2] = true;
    }

    fn faces(&mut self, slots: Range<usize>) {
        DirtyBlocks::faces(self, slots);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adjacent_blocks_are_one_range_and_a_face_may_span_two() {
        let mut touched = DirtyBlocks::new(1000);
        touched.word(0);
        // Words 126 to 128: the last two of one block, and the first of the next.
        touched.faces(42..43);
        touched.word(2999);
        assert_eq!(touched.take(), [0..256, 2944..3000]);
        assert_eq!(touched.take(), []);
        touched.faces(42..43);
        touched.faces(7..7);
        assert_eq!(touched.take(), [Range { start: 0, end: 256 }]);
    }
}
