//! What a paper, or several of them, does in a frame.

use super::{Slot, Target, View};
use crate::vk::{self, Frame, Gpu, Need, PassTime};
use std::time::Duration;
use thiserror::Error;

/// (name, bytes) of what was made, in video memory where the name does not say otherwise.
pub type Memory = Vec<(String, u64)>;

/// How far the last frame's picture is from the one that a camera at rest would show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Nothing is missing.
    Settled,
    /// Something is missing, and more of it is on its way.
    Arriving,
    /// So many things are missing, and in the last frame none came.
    Waiting { pending: usize },
}

/// Longest wait without a new arrival. A source may take seconds for one tile, not a minute: then something is broken.
pub const STALL: Duration = Duration::from_secs(60);

/// Nothing arrived for [`STALL`].
#[derive(Debug, Error)]
#[error(
    "{pending} visible tiles have not arrived for {} s; see the report's queues, or raise the load budget",
    STALL.as_secs()
)]
pub struct Stalled {
    pub pending: usize,
}

/// A part of a frame, or the whole of it. [`super::Run`] calls `retire`, `prepare` and `record` once for each frame, in
/// this order.
pub trait Technique {
    /// What one frame found out.
    type Record;
    type Error: From<vk::Error> + From<Stalled>;

    /// Device features that its passes need.
    fn needs(&self) -> Vec<Need>;

    /// Labels of its passes, in order.
    fn passes(&self) -> Vec<&'static str>;

    /// Takes what the last frame in `slot` found out; the device has passed it. `times` are those of all its passes.
    ///
    /// # Errors
    /// Device lost, out of memory.
    fn retire(&mut self, gpu: &Gpu, slot: Slot, times: Vec<PassTime>) -> Result<Self::Record, Self::Error>;

    /// The host's part of a frame: streams, chooses levels, fills staging memory.
    ///
    /// # Errors
    /// Out of memory.
    fn prepare(&mut self, gpu: &Gpu, view: &View) -> Result<(), Self::Error>;

    /// Records its passes.
    ///
    /// # Errors
    /// Out of memory.
    fn record(&mut self, frame: &mut Frame<'_>, view: &View, target: &Target) -> Result<(), Self::Error>;

    /// From the next frame on, a new target takes the place of the old one; no frame is in flight.
    ///
    /// # Errors
    /// Out of memory.
    fn resize(&mut self, gpu: &Gpu, target: &Target) -> Result<(), Self::Error>;

    /// About the last frame.
    fn progress(&self) -> Progress;

    fn memory(&self) -> Memory;
}
