//! Binary semaphores. They order a frame against work that queue order does not cover, such as presentation.

use super::device::{Dead, Device};
use super::{Check, Gpu, Result};
use ash::vk;
use std::sync::Arc;

/// Signalled by one submission; a later one waits for it.
pub struct Semaphore {
    pub(crate) handle: vk::Semaphore,
    device: Arc<Device>,
}

impl Gpu {
    /// # Errors
    /// Out of memory.
    pub fn semaphore(&self, name: &str) -> Result<Semaphore> {
        let info = vk::SemaphoreCreateInfo::default();
        // SAFETY: the device lives.
        let handle = unsafe { self.device.handle.create_semaphore(&info, None) };
        let handle = handle.check("vkCreateSemaphore", name)?;
        self.device.name(handle, name);
        Ok(Semaphore { handle, device: self.device.clone() })
    }
}

impl Drop for Semaphore {
    fn drop(&mut self) {
        self.device.bury(Dead::Semaphore(self.handle));
    }
}
