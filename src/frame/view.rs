//! The view of a frame.

use super::Slot;
use crate::math::camera::Pose;

/// Pose, picture size and frame number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    pub pose: Pose,
    /// Pixels.
    pub size: [u32; 2],
    /// Frame number from 0; seeds the random numbers of stochastic filters.
    pub frame: u64,
}

impl View {
    /// A single frame from `pose`.
    pub fn new(pose: &Pose, size: [u32; 2]) -> View {
        View { pose: *pose, size, frame: 0 }
    }

    /// The frame's slot among those in flight.
    pub fn slot(&self) -> Slot {
        Slot::of(self.frame)
    }
}
