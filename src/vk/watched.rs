//! A device for tests: dropping it panics if the validation layer has reported anything.

use super::{Gpu, GpuOptions};
use std::ops::Deref;

/// A device with validation and synchronisation validation. Dropping it panics if there were messages, unless
/// a panic is already in progress.
pub struct Watched(Gpu);

impl Watched {
    /// Opens a device, always with validation.
    ///
    /// # Panics
    /// If there is no such device, or no validation layer.
    pub fn open(options: &GpuOptions) -> Watched {
        let options = GpuOptions { validate: true, ..options.clone() };
        Watched(Gpu::new(&options).unwrap_or_else(|e| panic!("{e}; `./x test` installs missing parts")))
    }
}

impl Deref for Watched {
    type Target = Gpu;
    fn deref(&self) -> &Gpu {
        &self.0
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let messages = self.0.messages();
            assert!(messages.is_empty(), "{messages:#?}");
        }
    }
}
