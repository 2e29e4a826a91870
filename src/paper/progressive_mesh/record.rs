//! The record of each frame.

use super::surface::FrameChanges;
use crate::vk::PassTime;
use std::time::Duration;

/// One frame of a report.
#[derive(Clone, Debug)]
pub struct MeshFrameRecord {
    /// Number of the frame, from 0.
    pub index: u64,
    /// The sum over all surfaces.
    pub change: FrameChanges,
    /// The host's time for level changes: culling, choosing levels, executing them, and copying to mapped
    /// memory.
    pub host: Duration,
    /// The factor on the surfaces' wanted errors; 1 without a governor.
    pub error_factor: f64,
    pub passes: Vec<PassTime>,
}

impl MeshFrameRecord {
    /// The frame's time in milliseconds: the host's work on levels plus the device's passes. `None` if the
    /// device has no timestamps.
    pub fn milliseconds(&self) -> Option<f64> {
        let device_ns = self.passes.iter().map(|pass| pass.ns).sum::<Option<u64>>()?;
        Some(self.host.as_secs_f64() * 1e3 + device_ns as f64 / 1e6)
    }
}
