//! Thin wrappers around Vulkan objects, and the only `unsafe` of the crate.
//!
//! Wrappers own their handle and an `Arc` of the device. `Drop` moves handle and memory to a queue, which destroys them
//! once the GPU has finished every frame that could use them. Images stay in GENERAL, depth images in a layout of their
//! own. A [`Frame`] is a short list of passes, each with a label, one global barrier and two timestamps.

mod buffer;
mod command;
mod copy;
mod descriptors;
mod device;
mod error;
mod features;
mod format;
mod frame;
mod graphics_info;
mod image;
mod instance;
mod limits;
mod message;
mod physical;
mod pipeline;
mod query;
mod render;
pub mod renderdoc;
mod ring;
mod sampler;
pub mod self_test;
mod semaphore;
pub mod shader;
#[cfg(feature = "window")]
mod swapchain;
mod used;
mod watched;

pub use buffer::{Buffer, BufferUse, IndexType, MappedMut, MappedValues, TexelCopy};
pub use command::{Cmd, Resource};
pub use device::failure_at_the_end;
pub use error::Error;
pub use features::{Feature, Need};
pub use format::Format;
pub use frame::{Frame, Recorded, Ticket};
pub use graphics_info::{Blend, Depth, GraphicsInfo};
pub use image::{Image, ImageInfo, ReadAs, TargetPart};
pub use instance::{Instance, Survey, driver_folders};
pub use limits::group_line;
pub use message::{Message, Severity};
pub use physical::PhysicalDevice;
pub use pipeline::{ComputePipeline, GraphicsPipeline};
pub use query::{StreamCount, StreamQuery, Work};
pub use render::{
    Clear, ClippedSlice, ColorTarget, DepthTarget, IndexRange, IndexedGeometry, Render, TransformFeedback,
};
pub use ring::{FRAMES_IN_FLIGHT, PassTime};
pub use sampler::{Sampler, SamplerFilter, SamplerInfo};
pub use semaphore::Semaphore;
pub use shader::Access;
#[cfg(feature = "window")]
pub use swapchain::{Acquired, PresentMode, Swapchain, WindowSurface};
pub use used::{PassResources, Used};
pub use watched::Watched;

pub(crate) use error::Check;

use device::Device;
use pipeline::Pipelines;
use ring::Ring;
use std::sync::{Arc, Mutex};

pub type Result<T> = std::result::Result<T, Error>;

/// The display of a windowing system. In a build without the feature `window`, this type has no values.
#[cfg(feature = "window")]
pub type DisplayHandle<'a> = raw_window_handle::DisplayHandle<'a>;
#[cfg(not(feature = "window"))]
pub type DisplayHandle<'a> = &'a std::convert::Infallible;

/// How to open a device.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions<'a> {
    /// A device's index, or part of its name. `None`: the first usable one (discrete, then integrated, virtual,
    /// software).
    pub device: Option<&'a str>,
    /// Enables validation, with synchronisation validation.
    pub validate: bool,
    pub needs: &'a [Need],
    /// Enabled if the device has them; for runs that compare variants.
    pub wishes: &'a [Feature],
    /// The device must be able to present to the windows of this display.
    pub display: Option<DisplayHandle<'a>>,
}

/// An open device. Cheap to clone; the last clone closes it.
#[derive(Clone)]
pub struct Gpu {
    pub(crate) device: Arc<Device>,
    pub(crate) ring: Arc<Mutex<Ring>>,
    pub(crate) pipelines: Arc<Mutex<Pipelines>>,
}

impl Gpu {
    /// Opens the device with the features in `needs`, those in `wishes` that it has, and no others.
    ///
    /// # Errors
    /// No loader, driver or device; a missing feature, with the pass that needs it and the variant that works
    /// without it.
    pub fn new(options: &GpuOptions<'_>) -> Result<Gpu> {
        Gpu::for_device(options, |_| options.needs.to_vec())
    }

    /// As [`Gpu::new`], but with the needs that `needs` returns for the chosen device. Ignores `options.needs`.
    ///
    /// # Errors
    /// As [`Gpu::new`].
    pub fn for_device(
        options: &GpuOptions<'_>,
        needs: impl FnOnce(&PhysicalDevice) -> Vec<Need>,
    ) -> Result<Gpu> {
        let instance = Arc::new(Instance::presenting(options.validate, options.display)?);
        let presents = options.display.is_some();
        let physical = instance.choose(options.device, presents)?;
        if physical.api < (1, 3, 0) {
            let (major, minor, _) = physical.api;
            let what = format!(
                "Vulkan {major}.{minor}; 1.3 is required. Choose another --device, or update the driver"
            );
            return Err(Error::limit(&physical.name, what));
        }
        let needs = needs(&physical);
        physical.offered.require(&physical.name, &needs, presents)?;
        let needed = needs.iter().map(|need| need.feature);
        let optional = options.wishes.iter().copied().filter(|feature| physical.features.contains(feature));
        let features = needed.chain(optional).collect();
        let device = Arc::new(Device::new(instance, physical, features, presents)?);
        let ring = Arc::new(Mutex::new(Ring::new(&device)?));
        Ok(Gpu { device, ring, pipelines: Arc::default() })
    }

    pub fn physical(&self) -> &PhysicalDevice {
        &self.device.physical
    }

    /// True if passes have GPU timestamps.
    pub fn keeps_time(&self) -> bool {
        self.device.timestamp_bits > 0
    }

    pub fn has(&self, feature: Feature) -> bool {
        self.device.features.contains(&feature)
    }

    /// Checks that the device was opened with the features in `needs`.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] with the pass that needs it and the variant that works without it.
    pub fn require(&self, needs: &[Need]) -> Result<()> {
        Need::check_all(needs, &self.device.physical.name, |feature| self.has(feature))
    }

    /// (name, bytes) of every device-memory allocation, sorted; for finding leaks. Waits for the device.
    ///
    /// # Errors
    /// Device lost.
    pub fn allocations(&self) -> Result<Vec<(String, u64)>> {
        self.lock_ring().wait_for_all()?;
        self.device.collect(self.device.finished()?);
        let report = self.device.allocator.lock().expect("no panic in the allocator").generate_report();
        let allocations = report.allocations.into_iter();
        let mut allocations: Vec<_> = allocations.map(|one| (one.name, one.size)).collect();
        allocations.sort();
        Ok(allocations)
    }

    /// Validation messages so far. A test with messages fails.
    pub fn messages(&self) -> Vec<Message> {
        self.device.instance.messages()
    }
}
