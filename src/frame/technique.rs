//! The interface of a technique, which draws a part of a frame by the methods of one or several papers.

use super::{FrameSlot, Target, View};
use crate::vk::{self, Frame, Gpu, Need, PassTime};
use std::time::Duration;
use thiserror::Error;

/// (name, bytes) of each allocation; video memory unless the name says otherwise.
pub type Allocations = Vec<(String, u64)>;

/// How far the last frame's picture is from the converged picture of a static camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Nothing is missing.
    Settled,
    /// Something is missing, and more of it is arriving.
    Arriving,
    /// `pending` items are missing, and none arrived in the last frame.
    Waiting { pending: usize },
}

/// Longest wait without a new arrival. A slow source may take seconds for one tile; a minute means a fault.
pub const STALL: Duration = Duration::from_secs(60);

/// Nothing arrived for [`super::Run::stall`].
#[derive(Debug, Error)]
#[error(
    "{pending} visible tiles are missing, and none arrived for {} s; see `pending` and `loads` in the report, or raise the load budget",
    waited.as_secs()
)]
pub struct Stalled {
    pub pending: usize,
    pub waited: Duration,
}

/// A part of a frame, or all of it. [`super::Run`] calls `retire`, `prepare` and `record` once for each
/// frame, in this order.
pub trait Technique {
    /// The results of one frame.
    type Record;
    type Error: From<vk::Error> + From<Stalled>;

    /// Device features that its passes need.
    fn needs(&self) -> Vec<Need>;

    /// Labels of its passes, in order.
    fn passes(&self) -> Vec<&'static str>;

    /// Reads the results of the last frame in `slot`, which the device has finished. `times` has the
    /// time of each pass of that frame.
    ///
    /// # Errors
    /// Device lost, out of memory.
    fn retire(
        &mut self,
        gpu: &Gpu,
        slot: FrameSlot,
        times: Vec<PassTime>,
    ) -> Result<Self::Record, Self::Error>;

    /// Host work of a frame: streams, chooses levels, fills staging memory.
    ///
    /// # Errors
    /// Out of memory.
    fn prepare(&mut self, gpu: &Gpu, view: &View) -> Result<(), Self::Error>;

    /// Records its passes.
    ///
    /// # Errors
    /// Out of memory.
    fn record(&mut self, frame: &mut Frame<'_>, view: &View, target: &Target) -> Result<(), Self::Error>;

    /// Sets the target of the next frame. No frame is in flight. After an error, the technique still works with the old
    /// target.
    ///
    /// # Errors
    /// Out of memory.
    fn resize(&mut self, gpu: &Gpu, target: &Target) -> Result<(), Self::Error>;

    /// Lifts or restores the time budgets of streaming. Budgets keep frames short while the camera moves. Without
    /// budgets, all tiles arrive as soon as possible. [`super::Run::settle`] lifts them, because its frames are not
    /// shown; so does a window whose camera is at rest.
    fn lift_budgets(&mut self, _lifted: bool) {}

    /// Progress as of the last frame.
    fn progress(&self) -> Progress;

    fn memory(&self) -> Allocations;
}
