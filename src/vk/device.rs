//! The device: one queue, one allocator, and the deferred-destruction queue.

use super::instance::Instance;
use super::physical::PhysicalDevice;
use super::{Check, Error, Feature, Result};
use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocation, Allocator, AllocatorCreateDesc};
use std::mem::ManuallyDrop;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};

/// Device state that every wrapper shares through an `Arc`.
pub(crate) struct Device {
    pub(crate) handle: ash::Device,
    pub(crate) debug: Option<ext::debug_utils::Device>,
    pub(crate) feedback: Option<ext::transform_feedback::Device>,
    pub(crate) physical: PhysicalDevice,
    pub(crate) features: Vec<Feature>,
    pub(crate) queue: vk::Queue,
    pub(crate) queue_family: u32,
    pub(crate) timestamp_bits: u32,
    /// Counts submitted frames; its value is the last frame that has ended.
    pub(crate) timeline: vk::Semaphore,
    pub(crate) allocator: ManuallyDrop<Mutex<Allocator>>,
    objects: Mutex<Objects>,
    /// The highest value of the timeline that the host has waited for.
    pub(crate) waited: AtomicU64,
    /// The total time of these waits, in nanoseconds.
    pub(crate) waited_ns: AtomicU64,
    /// Shaders that were recompiled at run time.
    pub(crate) replaced: Mutex<super::shader::Replaced>,
    pub(crate) instance: Arc<Instance>,
}

/// Objects at the start and at the end of their lives.
#[derive(Default)]
pub(super) struct Objects {
    /// Transitions of new images that the next submission starts with.
    pub(super) new_images: Vec<vk::ImageMemoryBarrier2<'static>>,
    /// Number of frames that are being recorded. They may use every object that lives now.
    pub(super) recording: usize,
    /// The value that the last submission signals.
    submitted: u64,
    /// Objects that were dropped while frames that may use them were being recorded.
    held: Vec<Dead>,
    /// Dropped objects, each with the timeline value of the last submission that may use it.
    waiting: Vec<(u64, Dead)>,
}

/// A handle, with its memory, to be destroyed once the GPU no longer uses it.
pub(crate) enum Dead {
    Buffer(vk::Buffer, vk::BufferView, Option<Allocation>),
    Image(vk::Image, Vec<vk::ImageView>, Option<Allocation>),
    Sampler(vk::Sampler),
    Queries(vk::QueryPool),
    Semaphore(vk::Semaphore),
    Pipeline(vk::Pipeline, vk::PipelineLayout, vk::DescriptorSetLayout),
}

// SAFETY: barriers are plain data here (no pNext chain); the handles in them are used under Vulkan's own rules.
unsafe impl Send for Device {}
// SAFETY: the queue is only used under the ring's lock; a command pool belongs to one frame; mutexes guard all else.
unsafe impl Sync for Device {}

impl Objects {
    /// The frame was submitted or dropped; `submitted` is the value that the last submission signals.
    pub(super) fn end_recording(&mut self, submitted: u64) {
        self.recording -= 1;
        self.submitted = submitted;
        if self.recording == 0 {
            std::mem::take(&mut self.held).into_iter().for_each(|dead| self.discard(dead));
        }
    }

    /// Queues an object that no later submission uses.
    fn discard(&mut self, dead: Dead) {
        if let Dead::Image(image, ..) = dead {
            self.new_images.retain(|barrier| barrier.image != image);
        }
        self.waiting.push((self.submitted, dead));
    }
}

impl Device {
    pub(super) fn new(
        instance: Arc<Instance>,
        physical: PhysicalDevice,
        mut features: Vec<Feature>,
        presents: bool,
    ) -> Result<Device> {
        features.sort();
        features.dedup();
        let (queue_family, timestamp_bits) = queue_family(&instance, &physical)?;
        let handle = create(&instance, &physical, (&features, presents), queue_family)?;
        // SAFETY: one queue of this family was created with the device.
        let queue = unsafe { handle.get_device_queue(queue_family, 0) };
        let mut kind = vk::SemaphoreTypeCreateInfo::default()
            .semaphore_type(vk::SemaphoreType::TIMELINE)
            .initial_value(0);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the device lives.
        let timeline = unsafe { handle.create_semaphore(&info, None) }
            .check("vkCreateSemaphore", "timeline")
            // SAFETY: nothing was created from the device.
            .inspect_err(|_| unsafe { handle.destroy_device(None) })?;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.handle.clone(),
            device: handle.clone(),
            physical_device: physical.handle,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })
        .map_err(|e| Error::OutOfMemory { object: "allocator".into(), reason: e.to_string() })
        // SAFETY: only the semaphore was created from the device.
        .inspect_err(|_| unsafe {
            handle.destroy_semaphore(timeline, None);
            handle.destroy_device(None);
        })?;
        let device = Device {
            debug: instance.debug.as_ref().map(|_| ext::debug_utils::Device::new(&instance.handle, &handle)),
            feedback: features
                .contains(&Feature::TransformFeedback)
                .then(|| ext::transform_feedback::Device::new(&instance.handle, &handle)),
            handle,
            physical,
            features,
            queue,
            queue_family,
            timestamp_bits,
            timeline,
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            objects: Mutex::default(),
            waited: AtomicU64::new(0),
            waited_ns: AtomicU64::new(0),
            replaced: Mutex::default(),
            instance,
        };
        device.name(timeline, "timeline");
        device.name(queue, "queue");
        Ok(device)
    }

    /// Sets an object's name for debuggers and validation messages.
    pub(crate) fn name<H: vk::Handle>(&self, handle: H, name: &str) {
        let Some(debug) = &self.debug else { return };
        let name = std::ffi::CString::new(name).expect("names hold no null");
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: handle and string live. A name that cannot be set harms nothing.
        if let Err(result) = unsafe { debug.set_debug_utils_object_name(&info) } {
            tracing::debug!("no debug name for {name:?}: {result}");
        }
    }

    pub(crate) fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: gpu_allocator::MemoryLocation,
        linear: bool,
    ) -> Result<Allocation> {
        let allocate = || {
            self.allocator.lock().expect("no panic in the allocator").allocate(
                &gpu_allocator::vulkan::AllocationCreateDesc {
                    name,
                    requirements,
                    location,
                    linear,
                    allocation_scheme: gpu_allocator::vulkan::AllocationScheme::GpuAllocatorManaged,
                },
            )
        };
        // Dropped objects normally wait for the next frame. When memory is short, they are destroyed now.
        let allocation = match allocate() {
            Ok(allocation) => Ok(allocation),
            Err(_) => {
                self.collect(self.finished()?);
                allocate()
            }
        };
        allocation.map_err(|e| Error::OutOfMemory {
            object: name.to_string(),
            reason: format!("{} bytes: {e}", requirements.size),
        })
    }

    /// The timeline's value: every submission up to it has ended.
    pub(crate) fn finished(&self) -> Result<u64> {
        // SAFETY: the timeline lives.
        unsafe { self.handle.get_semaphore_counter_value(self.timeline) }
            .check("vkGetSemaphoreCounterValue", "timeline")
    }

    /// Reads the results of queries from number `first` on. Their frame must have ended.
    pub(super) fn query_results<T>(
        &self,
        pool: vk::QueryPool,
        first: u32,
        results: &mut [T],
        what: &str,
    ) -> Result<()> {
        if results.is_empty() {
            return Ok(());
        }
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the queries ended with their frame, which the caller has waited for.
        unsafe { self.handle.get_query_pool_results(pool, first, results, flags) }
            .check("vkGetQueryPoolResults", what)
    }

    pub(super) fn objects(&self) -> MutexGuard<'_, Objects> {
        self.objects.lock().expect("no panic while objects are moved")
    }

    /// Queues the object of a dropped wrapper for destruction.
    pub(crate) fn bury(&self, dead: Dead) {
        let mut objects = self.objects();
        match objects.recording {
            0 => objects.discard(dead),
            _ => objects.held.push(dead),
        }
    }

    /// Destroys objects that no submitted frame uses any more.
    pub(crate) fn collect(&self, finished: u64) {
        let mut objects = self.objects();
        let dead: Vec<_> = objects.waiting.extract_if(.., |(value, _)| *value <= finished).collect();
        drop(objects);
        dead.into_iter().for_each(|(_, dead)| self.destroy(dead));
    }

    fn destroy(&self, dead: Dead) {
        // SAFETY: the GPU has finished every frame that could use the handle, and its wrapper is gone.
        unsafe {
            match &dead {
                Dead::Buffer(buffer, view, _) => {
                    self.handle.destroy_buffer_view(*view, None);
                    self.handle.destroy_buffer(*buffer, None);
                }
                Dead::Image(image, views, _) => {
                    views.iter().for_each(|view| self.handle.destroy_image_view(*view, None));
                    self.handle.destroy_image(*image, None);
                }
                Dead::Sampler(sampler) => self.handle.destroy_sampler(*sampler, None),
                Dead::Queries(pool) => self.handle.destroy_query_pool(*pool, None),
                Dead::Semaphore(semaphore) => self.handle.destroy_semaphore(*semaphore, None),
                Dead::Pipeline(pipeline, layout, set_layout) => {
                    self.handle.destroy_pipeline(*pipeline, None);
                    self.handle.destroy_pipeline_layout(*layout, None);
                    self.handle.destroy_descriptor_set_layout(*set_layout, None);
                }
            }
        }
        if let Dead::Buffer(.., Some(memory)) | Dead::Image(.., Some(memory)) = dead {
            let freed = self.allocator.lock().expect("no panic in the allocator").free(memory);
            assert!(freed.is_ok(), "the allocator refuses its own allocation: {freed:?}");
        }
    }
}

fn queue_family(instance: &Instance, physical: &PhysicalDevice) -> Result<(u32, u32)> {
    // SAFETY: plain query on a live instance.
    let families = unsafe { instance.handle.get_physical_device_queue_family_properties(physical.handle) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    families
        .iter()
        .position(|family| family.queue_flags.contains(wanted))
        .map(|index| (index as u32, families[index].timestamp_valid_bits))
        .ok_or_else(|| {
            Error::limit(&physical.name, "no queue for graphics and compute; choose another --device")
        })
}

fn create(
    instance: &Instance,
    physical: &PhysicalDevice,
    (features, presents): (&[Feature], bool),
    queue_family: u32,
) -> Result<ash::Device> {
    let has = |feature| features.contains(&feature);
    let priorities = [1.0];
    let queues =
        [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&priorities)];
    let core = vk::PhysicalDeviceFeatures::default()
        .geometry_shader(has(Feature::GeometryShader))
        .logic_op(has(Feature::LogicOp))
        .pipeline_statistics_query(has(Feature::PipelineStatistics))
        .sampler_anisotropy(has(Feature::SamplerAnisotropy))
        .shader_int64(has(Feature::Int64))
        .texture_compression_bc(has(Feature::TextureCompressionBc))
        .fragment_stores_and_atomics(has(Feature::FragmentStores));
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default()
        .scalar_block_layout(true)
        .storage_buffer8_bit_access(has(Feature::ByteStores))
        .timeline_semaphore(true)
        .host_query_reset(true);
    let mut v13 =
        vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true);
    let mut feedback = vk::PhysicalDeviceTransformFeedbackFeaturesEXT::default().transform_feedback(true);
    let extensions = [
        (khr::swapchain::NAME, presents),
        (khr::portability_subset::NAME, physical.offered.portability_subset),
        (ext::transform_feedback::NAME, has(Feature::TransformFeedback)),
    ];
    let extensions: Vec<_> =
        extensions.iter().filter(|(_, enabled)| *enabled).map(|(name, _)| name.as_ptr()).collect();
    let mut info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_features(&core);
    if has(Feature::TransformFeedback) {
        info = info.push_next(&mut feedback);
    }
    info = info.enabled_extension_names(&extensions).push_next(&mut v12).push_next(&mut v13);
    // SAFETY: every pointer in `info` lives on this stack frame.
    unsafe { instance.handle.create_device(physical.handle, &info, None) }
        .check("vkCreateDevice", &physical.name)
}

static AT_THE_END: OnceLock<Error> = OnceLock::new();

/// The first error that occurred while a device was closed. A process whose run has otherwise succeeded must report it.
pub fn failure_at_the_end() -> Option<Error> {
    AT_THE_END.get().cloned()
}

impl Device {
    /// Waits until the device is idle, so that objects can be destroyed. An error does not prevent this: a lost device
    /// no longer uses any object. `Drop` cannot return the error, so it is kept for [`failure_at_the_end`].
    pub(crate) fn wait_at_the_end(&self) {
        // SAFETY: the device lives; nobody else uses the queue when a device or its ring is dropped.
        let idle = unsafe { self.handle.device_wait_idle() };
        if let Err(error) = idle.check("vkDeviceWaitIdle", &self.physical.name) {
            tracing::debug!("at shutdown: {error}");
            AT_THE_END.get_or_init(|| error);
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.wait_at_the_end();
        // SAFETY: the last Arc is gone, so no wrapper and no frame exists; after the wait the GPU uses no
        // object.
        unsafe {
            self.collect(u64::MAX);
            ManuallyDrop::drop(&mut self.allocator);
            self.handle.destroy_semaphore(self.timeline, None);
            self.handle.destroy_device(None);
        }
    }
}
