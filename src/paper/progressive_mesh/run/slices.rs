//! Allocation of one index buffer to the drawn faces of many instances.

use std::collections::BTreeMap;
use thiserror::Error;

/// One slice of an index buffer for each instance. Slices come in few sizes, so that they can be reused. A new slice
/// holds at least 64 faces, or all faces of a smaller mesh. Larger slices have at most a quarter more slots than faces.
/// When its instance becomes coarser, a slice may become up to four times too large. This type holds no faces: the
/// caller copies the faces when an instance gets another slice.
#[derive(Clone, Debug)]
pub struct Slices {
    of_instances: Vec<FreeFaces>,
    /// First faces of free slices, by size.
    free: BTreeMap<u32, Vec<u32>>,
    /// Returned slices, not reusable before [`Slices::release`].
    given_back: Vec<FreeFaces>,
    /// Faces of the whole buffer, including free slices.
    end: u32,
    /// Faces of the full mesh.
    max: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FreeFaces {
    first: u32,
    size: u32,
}

/// The faces exceed what a draw's 32-bit indices can address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "{faces} faces in all instances exceed a draw's 2^32 indices; show fewer instances, or coarser ones (error_pixels)"
)]
pub struct TooMany {
    pub faces: u64,
}

/// The size of a slice for `faces` faces: 64, 80, 96, 112, 128, 160 …, but never more than `max`.
fn size_for(faces: u32, max: u32) -> u32 {
    let octave = faces.max(64).ilog2();
    faces.max(64).next_multiple_of(1 << (octave - 2)).min(max)
}

impl Slices {
    /// No slices yet, for instances of a mesh whose finest level has `max` faces.
    pub fn new(max: u32) -> Slices {
        let (of_instances, free, given_back) = (Vec::new(), BTreeMap::new(), Vec::new());
        Slices { of_instances, free, given_back, end: 0, max }
    }

    /// Adds an instance, with a slice for `faces` faces.
    ///
    /// # Errors
    /// [`TooMany`].
    pub fn push(&mut self, faces: u32) -> Result<(), TooMany> {
        let slice = self.take(size_for(faces, self.max))?;
        self.of_instances.push(slice);
        Ok(())
    }

    /// The number of instances.
    pub fn len(&self) -> usize {
        self.of_instances.len()
    }

    pub fn is_empty(&self) -> bool {
        self.of_instances.is_empty()
    }

    /// The number of the first face of an instance's slice in the whole buffer.
    pub fn first(&self, instance: usize) -> u32 {
        self.of_instances[instance].first
    }

    /// Number of faces in the whole buffer. This number never falls.
    pub fn end(&self) -> u32 {
        self.end
    }

    /// Bytes of main memory.
    pub fn bytes(&self) -> usize {
        let free: usize = self.free.values().map(|firsts| size_of_val(&**firsts)).sum();
        size_of_val(&*self.of_instances) + size_of_val(&*self.given_back) + free
    }

    /// Makes an instance's slice large enough for `faces` faces and at most four times too large. If the instance gets
    /// another slice, returns the first face of the old slice and the first face of the new slice. The old slice keeps
    /// its faces until [`Slices::release`].
    ///
    /// # Errors
    /// [`TooMany`]; the slice is unchanged.
    pub fn fit(&mut self, instance: usize, faces: u32) -> Result<Option<[u32; 2]>, TooMany> {
        let old = self.of_instances[instance];
        let size = size_for(faces, self.max);
        if size == old.size || (size < old.size && 4 * u64::from(size) >= u64::from(old.size)) {
            return Ok(None);
        }
        let new = self.take(size)?;
        self.given_back.push(old);
        self.of_instances[instance] = new;
        Ok(Some([old.first, new.first]))
    }

    /// Makes returned slices reusable. Must be called only after the faces of these slices have been copied.
    pub fn release(&mut self) {
        for FreeFaces { first, size } in self.given_back.drain(..) {
            self.free.entry(size).or_default().push(first);
        }
    }

    fn take(&mut self, size: u32) -> Result<FreeFaces, TooMany> {
        if let Some(first) = self.free.get_mut(&size).and_then(Vec::pop) {
            return Ok(FreeFaces { first, size });
        }
        let faces = u64::from(self.end) + u64::from(size);
        if faces > u64::from(u32::MAX / 3) {
            return Err(TooMany { faces });
        }
        let first = std::mem::replace(&mut self.end, faces as u32);
        Ok(FreeFaces { first, size })
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

    #[test]
    fn a_returned_slice_is_reused_only_after_its_faces_are_copied() {
        let mut slices = Slices::new(10_000);
        (0..2).for_each(|_| slices.push(64).unwrap());
        assert_eq!(slices.fit(0, 100), Ok(Some([0, 128])));
        assert_eq!((slices.fit(0, 40), slices.fit(0, 112)), (Ok(None), Ok(None)), "not four times too large");
        slices.push(64).unwrap();
        assert_eq!(
            (slices.first(2), slices.end()),
            (240, 304),
            "the old slice of instance 0 is not free yet"
        );
        slices.release();
        slices.push(64).unwrap();
        assert_eq!((slices.first(3), slices.end()), (0, 304));
    }

    #[test]
    fn more_faces_than_32_bits_address_are_rejected_and_nothing_changes() {
        let mut slices = Slices::new(1 << 30);
        slices.push(1 << 30).unwrap();
        slices.push(64).unwrap();
        assert_eq!(slices.fit(1, 1 << 29), Err(TooMany { faces: (1 << 30) + 64 + (1 << 29) }));
        assert_eq!((slices.first(1), slices.end()), (1 << 30, (1 << 30) + 64));
    }
}
