//! The ring of the frames in flight: command pools, queries and descriptors, each used again once the GPU has finished
//! the frame before.

use super::buffer::Uses;
use super::descriptors::Descriptors;
use super::device::Device;
use super::query::statistics_info;
use super::{Check, Feature, Result, Work};
use ash::vk;
use serde::Serialize;
use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

/// Number of frames that the host may be ahead of the GPU. The results of a frame are used this many frames later.
pub const FRAMES_IN_FLIGHT: usize = 2;

/// Limit of passes in a frame; each takes two timestamps.
pub(super) const MAX_PASSES: usize = 64;

/// Time and work of a pass.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PassTime {
    pub label: String,
    /// Nanoseconds between its two timestamps; `None` if the device has no timestamps.
    pub ns: Option<u64>,
    /// `None` unless [`super::Gpu::count_work`] enabled counting.
    #[serde(skip)]
    pub work: Option<Work>,
}

impl PassTime {
    /// A time without counted work.
    pub fn new(label: impl Into<String>, ns: Option<u64>) -> PassTime {
        PassTime { label: label.into(), ns, work: None }
    }

    /// The host's time for `work`, as a pass.
    pub fn of_host<T>(label: impl Into<String>, work: impl FnOnce() -> T) -> PassTime {
        let start = Instant::now();
        std::hint::black_box(work());
        PassTime::new(label, Some(start.elapsed().as_nanos() as u64))
    }
}

pub(super) type Times = Arc<OnceLock<Vec<PassTime>>>;

/// One frame's command pool, queries and descriptors.
pub(super) struct Slot {
    pool: vk::CommandPool,
    pub(super) buffer: vk::CommandBuffer,
    /// Transitions new images, before `buffer`.
    transitions: vk::CommandBuffer,
    pub(super) descriptors: Descriptors,
    pub(super) queries: vk::QueryPool,
    /// Pipeline statistics, if the device was opened with them.
    pub(super) statistics: Option<vk::QueryPool>,
    pub(super) labels: Vec<String>,
    /// One for each label if the frame counts its work; otherwise empty.
    pub(super) works: Vec<Work>,
    /// The mapped buffers that the frame uses.
    pub(super) mapped: Vec<Arc<Uses>>,
    /// The timeline's value once the GPU has finished the slot's last submission.
    pub(super) value: u64,
    pub(super) times: Times,
}

/// The free slots: those into which no frame is being recorded. The least recently submitted slot is first.
pub(crate) struct Ring {
    pub(super) slots: VecDeque<Slot>,
    device: Arc<Device>,
    pub(super) submitted: u64,
    /// True if the next frames count the work of their passes.
    pub(super) counting: bool,
    /// True if the next frames list the resources of their passes.
    pub(super) listing: bool,
}

impl Ring {
    pub(crate) fn new(device: &Arc<Device>) -> Result<Ring> {
        let slots = (0..FRAMES_IN_FLIGHT).map(|_| Slot::new(device)).collect::<Result<_>>()?;
        Ok(Ring { slots, device: device.clone(), submitted: 0, counting: false, listing: false })
    }

    /// Waits for every frame that was submitted.
    pub(crate) fn wait_for_all(&self) -> Result<()> {
        self.device.wait(self.submitted)
    }

    /// The timeline value to wait for before the next frame can use the first slot. Adds a slot if none is free.
    pub(super) fn frees_slot(&mut self) -> Result<u64> {
        if self.slots.is_empty() {
            self.slots.push_back(Slot::new(&self.device)?);
        }
        let before = self.submitted.saturating_sub(FRAMES_IN_FLIGHT as u64 - 1);
        Ok(before.max(self.slots[0].value))
    }
}

impl Device {
    /// Waits until the GPU has finished a submission, and all before it.
    pub(super) fn wait(&self, value: u64) -> Result<()> {
        let (semaphores, values) = ([self.timeline], [value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        let begun = Instant::now();
        // SAFETY: the timeline lives; every value waited for was submitted.
        let waited = unsafe { self.handle.wait_semaphores(&info, u64::MAX) };
        self.waited_ns.fetch_add(begun.elapsed().as_nanos() as u64, Ordering::Relaxed);
        waited.check("vkWaitSemaphores", "frame")?;
        self.waited.fetch_max(value, Ordering::SeqCst);
        Ok(())
    }
}

impl Slot {
    fn new(device: &Device) -> Result<Slot> {
        let pool_info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(device.queue_family)
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        let query_info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(2 * MAX_PASSES as u32);
        // SAFETY: the device lives. A failure half-way leaks a pool, but ends the program.
        unsafe {
            let pool =
                device.handle.create_command_pool(&pool_info, None).check("vkCreateCommandPool", "frame")?;
            let buffers = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(2);
            let buffers = device
                .handle
                .allocate_command_buffers(&buffers)
                .check("vkAllocateCommandBuffers", "frame")?;
            let [buffer, transitions] = [buffers[0], buffers[1]];
            let descriptors = Descriptors::new(device)?;
            let queries =
                device.handle.create_query_pool(&query_info, None).check("vkCreateQueryPool", "frame")?;
            let statistics = match device.features.contains(&Feature::PipelineStatistics) {
                true => {
                    let info = statistics_info(MAX_PASSES as u32);
                    Some(device.handle.create_query_pool(&info, None).check("vkCreateQueryPool", "frame")?)
                }
                false => None,
            };
            device.name(pool, "frame commands");
            device.name(buffer, "frame");
            device.name(transitions, "new images");
            device.name(queries, "frame timestamps");
            Ok(Slot {
                pool,
                buffer,
                transitions,
                descriptors,
                queries,
                statistics,
                labels: Vec::new(),
                works: Vec::new(),
                mapped: Vec::new(),
                value: 0,
                times: Times::default(),
            })
        }
    }

    /// Stores the times of the slot's last frame, which has ended.
    pub(super) fn read_times(&mut self, device: &Device) -> Result<()> {
        if self.times.get().is_some() {
            return Ok(());
        }
        let labels = std::mem::take(&mut self.labels);
        let mut works = std::mem::take(&mut self.works);
        if let Some(statistics) = self.statistics {
            Work::add_statistics(device, statistics, &mut works)?;
        }
        let mut stamps = vec![0u64; 2 * labels.len()];
        if device.timestamp_bits > 0 {
            device.query_results(self.queries, 0, &mut stamps, "timestamps")?;
        }
        // Counters narrower than 64 bits wrap, so the difference is masked.
        let mask = u64::MAX.checked_shr(64 - device.timestamp_bits).unwrap_or(0);
        let period_ns = f64::from(device.physical.limits.timestamp_period);
        let times = labels.into_iter().enumerate().map(|(n, label)| {
            let ticks = stamps[2 * n + 1].wrapping_sub(stamps[2 * n]) & mask;
            let ns = (device.timestamp_bits > 0).then_some((ticks as f64 * period_ns) as u64);
            PassTime { label, ns, work: works.get(n).copied() }
        });
        self.times.get_or_init(|| times.collect());
        Ok(())
    }

    /// Prepares the slot, whose last frame has ended, for the commands of another.
    pub(super) fn begin(&mut self, device: &Device) -> Result<()> {
        self.forget_frame();
        self.times = Times::default();
        self.descriptors.reset(device)?;
        // SAFETY: the GPU has finished the slot's last frame, and the slot belongs to one frame.
        unsafe {
            device
                .handle
                .reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .check("vkResetCommandPool", "frame")?;
            device.handle.reset_query_pool(self.queries, 0, 2 * MAX_PASSES as u32);
            if let Some(statistics) = self.statistics {
                device.handle.reset_query_pool(statistics, 0, MAX_PASSES as u32);
            }
            device.handle.begin_command_buffer(self.buffer, &once()).check("vkBeginCommandBuffer", "frame")
        }
    }

    /// Ends the recording with a barrier, so that the host can read what the frame writes.
    pub(super) fn end(&mut self, device: &Device) -> Result<()> {
        let to_host = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&to_host);
        self.mapped.iter().for_each(|buffer| buffer.require_no_view());
        // SAFETY: the recording began with the frame.
        unsafe {
            device.handle.cmd_pipeline_barrier2(self.buffer, &dependency);
            device.handle.end_command_buffer(self.buffer).check("vkEndCommandBuffer", "frame")
        }
    }

    /// The command buffers of the submission. The first one transitions `new_images`, if there are any. It is recorded
    /// at submission, because the first frame to be submitted must transition them, in whatever order frames are
    /// recorded.
    pub(super) fn commands(
        &self,
        device: &Device,
        new_images: &[vk::ImageMemoryBarrier2<'static>],
    ) -> Result<Vec<vk::CommandBufferSubmitInfo<'static>>> {
        let buffer = |handle| vk::CommandBufferSubmitInfo::default().command_buffer(handle);
        if new_images.is_empty() {
            return Ok(vec![buffer(self.buffer)]);
        }
        let barrier = vk::DependencyInfo::default().image_memory_barriers(new_images);
        // SAFETY: the buffer was reset with its pool; the images live while their barriers are queued.
        unsafe {
            device
                .handle
                .begin_command_buffer(self.transitions, &once())
                .check("vkBeginCommandBuffer", "new images")?;
            device.handle.cmd_pipeline_barrier2(self.transitions, &barrier);
            device.handle.end_command_buffer(self.transitions).check("vkEndCommandBuffer", "new images")?;
        }
        Ok(vec![buffer(self.transitions), buffer(self.buffer)])
    }

    pub(super) fn forget_frame(&mut self) {
        self.labels.clear();
        self.works.clear();
        self.mapped.clear();
    }
}

fn once() -> vk::CommandBufferBeginInfo<'static> {
    vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT)
}

impl Drop for Ring {
    fn drop(&mut self) {
        self.device.wait_at_the_end();
        // SAFETY: after the wait the GPU uses none of the pools.
        unsafe {
            for slot in &mut self.slots {
                self.device.handle.destroy_command_pool(slot.pool, None);
                slot.descriptors.destroy(&self.device);
                self.device.handle.destroy_query_pool(slot.queries, None);
                slot.statistics
                    .into_iter()
                    .for_each(|pool| self.device.handle.destroy_query_pool(pool, None));
            }
        }
    }
}
