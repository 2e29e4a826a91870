//! Vulkan's nouns, and the only `unsafe` of the crate.
//!
//! Wrappers own their handle and an `Arc` of the device. `Drop` hands handle and memory to a queue that is
//! emptied when the GPU has passed every frame that could name them. Images live in GENERAL. A [`Frame`] is a
//! short list of passes, each with label, one global barrier and two timestamps.

mod buffer;
mod command;
mod device;
mod error;
mod features;
mod frame;
mod image;
mod instance;
mod message;
mod pipeline;
mod query;
mod render;
pub mod self_test;
mod semaphore;
pub mod shader;
mod swapchain;
mod watched;

pub use buffer::{Buffer, BufferUse, TexelCopy};
pub use command::{Cmd, Resource};
pub use error::Error;
pub use features::{Feature, Need};
pub use frame::{FRAMES_IN_FLIGHT, Frame, PassTime, Ticket};
pub use image::{Filter, Format, Image, ImageInfo, Sampler, SamplerInfo, View};
pub use instance::{Instance, PhysicalDevice, Survey, driver_folders};
pub use message::{Message, Severity};
pub use pipeline::{Blend, ComputePipeline, Depth, GraphicsInfo, GraphicsPipeline};
pub use query::{ShaderCounts, ShaderQuery, StreamCount, StreamQuery};
pub use render::{Clear, ClippedSlice, ColorTarget, DepthTarget, Geometry, Render, Slice, TransformFeedback};
pub use semaphore::Semaphore;
pub use swapchain::{Acquired, PresentMode, Surface, Swapchain};
pub use watched::Watched;

pub(crate) use error::Check;

use device::Device;
use frame::Ring;
use raw_window_handle::DisplayHandle;
use std::sync::{Arc, Mutex};

pub type Result<T> = std::result::Result<T, Error>;

/// How to open a device.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions<'a> {
    /// Part of a device's name, or its index; `None`: the first usable, discrete before integrated before software.
    pub device: Option<&'a str>,
    /// Validation with synchronisation validation.
    pub validate: bool,
    pub needs: &'a [Need],
    /// Switched on where the device has them: for runs that compare variants.
    pub wishes: &'a [Feature],
    /// Whose windows the device is to present to.
    pub display: Option<DisplayHandle<'a>>,
}

/// An open device. Cheap to clone; the last clone closes it.
#[derive(Clone)]
pub struct Gpu {
    pub(crate) device: Arc<Device>,
    pub(crate) ring: Arc<Mutex<Ring>>,
}

impl Gpu {
    /// Opens the device with exactly the features that `needs` and `wishes` name.
    ///
    /// # Errors
    /// No loader, driver or device; a missing feature, with the pass that wants it and the variant that does without.
    pub fn new(options: &GpuOptions<'_>) -> Result<Gpu> {
        let instance = Arc::new(Instance::presenting(options.validate, options.display)?);
        let physical = instance.choose(options.device)?;
        if physical.api < (1, 3, 0) {
            let (major, minor, _) = physical.api;
            return Err(Error::Limit {
                object: physical.name,
                what: format!(
                    "Vulkan {major}.{minor}; 1.3 is needed. Choose another --device, or update the driver"
                ),
            });
        }
        physical.offered.require(&physical.name, options.needs)?;
        let needed = options.needs.iter().map(|need| need.feature);
        let wished = options.wishes.iter().copied().filter(|wish| physical.features.contains(wish));
        let features = needed.chain(wished).collect();
        let device = Arc::new(Device::new(instance, physical, features, options.display.is_some())?);
        let ring = Arc::new(Mutex::new(Ring::new(&device)?));
        Ok(Gpu { device, ring })
    }

    pub fn physical(&self) -> &PhysicalDevice {
        &self.device.physical
    }

    pub fn has(&self, feature: Feature) -> bool {
        self.device.features.contains(&feature)
    }

    /// Whether the device was opened with what `needs` names.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] with the pass that wants it and the variant that does without.
    pub fn require(&self, needs: &[Need]) -> Result<()> {
        let Some(missing) = needs.iter().find(|need| !self.has(need.feature)) else { return Ok(()) };
        Err(Error::MissingFeature {
            device: self.device.physical.name.clone(),
            feature: missing.feature.name(),
            pass: missing.pass,
            without: missing.without,
        })
    }

    /// (name, bytes) of everything that has device memory now, sorted: for finding what is never given back. Waits for
    /// the device.
    ///
    /// # Errors
    /// Device lost.
    pub fn allocations(&self) -> Result<Vec<(String, u64)>> {
        let ring = self.ring.lock().expect("no panic while a frame is recorded");
        ring.wait_for_all()?;
        self.device.collect(self.device.finished()?, None);
        let report = self.device.allocator.lock().expect("no panic in the allocator").generate_report();
        let allocations = report.allocations.into_iter();
        let mut allocations: Vec<_> = allocations.map(|one| (one.name, one.size)).collect();
        allocations.sort();
        Ok(allocations)
    }

    /// Validation messages so far (none, or the test that caused them fails).
    pub fn messages(&self) -> Vec<Message> {
        self.device.instance.messages()
    }
}
