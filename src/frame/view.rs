//! What a frame looks at.

use super::Slot;
use crate::math::camera::Pose;

/// The eye, and the frame that it sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    pub pose: Pose,
    /// Pixels.
    pub size: [u32; 2],
    /// Counts from 0; noise changes with it.
    pub frame: u64,
}

impl View {
    /// A single frame from `pose`.
    pub fn new(pose: &Pose, size: [u32; 2]) -> View {
        View { pose: *pose, size, frame: 0 }
    }

    /// The frame's place among those in flight.
    pub fn slot(&self) -> Slot {
        Slot::of(self.frame)
    }
}
