//! What is kept of each frame.

use super::surface::Change;
use crate::vk::{PassTime, ShaderCounts};
use std::time::Duration;

/// One frame, as the report tells it.
#[derive(Clone, Debug)]
pub struct FrameRecord {
    /// 0 for the first.
    pub index: u64,
    /// Of all surfaces together.
    pub change: Change,
    /// The host's time for levels: who is seen, which level, its execution and the copies into mapped memory.
    pub host: Duration,
    /// By what the surfaces' wanted errors were multiplied; 1 without a governor.
    pub error_factor: f64,
    pub passes: Vec<PassTime>,
    /// What the device counted, where it was asked to.
    pub counts: Option<ShaderCounts>,
}

impl FrameRecord {
    /// The frame's time in milliseconds: the host's work on levels and the device's passes, one after the other; `None`
    /// where the device keeps no time.
    pub fn milliseconds(&self) -> Option<f64> {
        let device_ns = self.passes.iter().map(|pass| pass.ns).sum::<Option<u64>>()?;
        Some(self.host.as_secs_f64() * 1e3 + device_ns as f64 / 1e6)
    }
}
