//! Data that exists once for each frame in flight.

use crate::vk::FRAMES_IN_FLIGHT;
use std::ops::{Index, IndexMut};

/// One of the [`FRAMES_IN_FLIGHT`] slots that frames use in rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameSlot(usize);

impl FrameSlot {
    /// For work that never overlaps another frame.
    pub const FIRST: FrameSlot = FrameSlot(0);

    /// The slot's index, 0 ..= [`FRAMES_IN_FLIGHT`] - 1.
    pub fn index(self) -> u32 {
        self.0 as u32
    }

    /// The slot of frame number `frame`.
    pub fn of(frame: u64) -> FrameSlot {
        FrameSlot((frame % FRAMES_IN_FLIGHT as u64) as usize)
    }
}

/// One value for each frame in flight, indexed by its [`FrameSlot`].
#[derive(Debug, Default)]
pub struct PerFrame<T>([T; FRAMES_IN_FLIGHT]);

impl<T> PerFrame<T> {
    /// # Errors
    /// The first error of `make`.
    pub fn new<E>(mut make: impl FnMut() -> Result<T, E>) -> Result<PerFrame<T>, E> {
        let values = (0..FRAMES_IN_FLIGHT).map(|_| make()).collect::<Result<Vec<T>, E>>()?;
        let values =
            values.try_into().unwrap_or_else(|_| unreachable!("one was made for each frame in flight"));
        Ok(PerFrame(values))
    }

    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.0.iter()
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.0.iter_mut()
    }
}

impl<T> Index<FrameSlot> for PerFrame<T> {
    type Output = T;
    fn index(&self, slot: FrameSlot) -> &T {
        &self.0[slot.0]
    }
}

impl<T> IndexMut<FrameSlot> for PerFrame<T> {
    fn index_mut(&mut self, slot: FrameSlot) -> &mut T {
        &mut self.0[slot.0]
    }
}
