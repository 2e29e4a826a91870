//! The view of a frame.

use super::FrameSlot;
use crate::math::camera::Pose;

/// Seconds from frame to frame, unless a window measures them.
pub const FRAME_SECONDS: f64 = 1.0 / 60.0;

/// Pose, picture size, frame number, time and seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    pub pose: Pose,
    /// Pixels.
    pub size: [u32; 2],
    /// Frame number from 0.
    pub frame: u64,
    /// Time since the previous frame.
    pub seconds: f64,
    /// Seed of the random numbers of stochastic filters. All frames of a settling picture have the same seed, so that
    /// the picture does not depend on their number.
    pub noise: u64,
}

impl View {
    /// A single frame from `pose`.
    pub fn new(pose: &Pose, size: [u32; 2]) -> View {
        View { pose: *pose, size, frame: 0, seconds: FRAME_SECONDS, noise: 0 }
    }

    /// The frame's slot among those in flight.
    pub fn slot(&self) -> FrameSlot {
        FrameSlot::of(self.frame)
    }
}
