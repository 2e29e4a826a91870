//! A frame: a short list of passes, in a ring of [`FRAMES_IN_FLIGHT`].
//!
//! `pass` = debug label + timestamp + one global memory barrier + the closure + timestamp + end of label. No pass
//! declares what it reads or writes, so no dependency can be forgotten. Passes never overlap, so their times add up.

use super::command::Cmd;
use super::descriptors::Descriptors;
use super::device::Device;
use super::query::statistics_info;
use super::{Check, Error, Feature, Gpu, Image, Result, Semaphore, Work};
use ash::vk;
use std::sync::{Arc, Mutex, MutexGuard};

/// Number of frames that the host may be ahead of the GPU. The results of a frame are used this many frames
/// later.
pub const FRAMES_IN_FLIGHT: usize = 2;

/// Limit of passes in a frame; each takes two timestamps.
const MOST_PASSES: usize = 64;

/// Time and work of a pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PassTime {
    pub label: String,
    /// Nanoseconds between its two timestamps; `None` if the device has no timestamps.
    pub ns: Option<u64>,
    /// `None` unless [`Gpu::count_work`] enabled counting.
    pub work: Option<Work>,
}

type Times = Arc<Mutex<Option<Vec<PassTime>>>>;

/// One frame's command pool, queries and descriptors.
struct Slot {
    pool: vk::CommandPool,
    buffer: vk::CommandBuffer,
    descriptors: Descriptors,
    queries: vk::QueryPool,
    /// Pipeline statistics, if the device was opened with them.
    statistics: Option<vk::QueryPool>,
    labels: Vec<String>,
    /// One for each label if the frame counts its work; otherwise empty.
    works: Vec<Work>,
    /// The timeline's value once the GPU has finished the slot's last submission.
    value: u64,
    times: Times,
}

pub(crate) struct Ring {
    slots: Vec<Slot>,
    device: Arc<Device>,
    pub(super) submitted: u64,
    /// True if the next frames count the work of their passes.
    counting: bool,
}

/// A frame that is being recorded.
pub struct Frame<'a> {
    ring: MutexGuard<'a, Ring>,
    gpu: &'a Gpu,
    slot: usize,
    submitted: bool,
    /// Images that this frame transitions to GENERAL. They are queued again if the frame is not submitted.
    transitions: Vec<vk::ImageMemoryBarrier2<'static>>,
}

/// A submitted frame.
pub struct Ticket {
    gpu: Gpu,
    value: u64,
    slot: usize,
    times: Times,
}

impl Ring {
    pub(crate) fn new(device: &Arc<Device>) -> Result<Ring> {
        let slots = (0..FRAMES_IN_FLIGHT).map(|_| Slot::new(device)).collect::<Result<_>>()?;
        Ok(Ring { slots, device: device.clone(), submitted: 0, counting: false })
    }

    /// Waits for every frame that was submitted.
    pub(crate) fn wait_for_all(&self) -> Result<()> {
        self.wait(self.submitted)
    }

    fn wait(&self, value: u64) -> Result<()> {
        let (semaphores, values) = ([self.device.timeline], [value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the timeline lives; every value waited for was submitted.
        unsafe { self.device.handle.wait_semaphores(&info, u64::MAX) }.check("vkWaitSemaphores", "frame")
    }

    /// Reads the times of the slot's last frame, once it has ended.
    fn read_times(&mut self, slot: usize) -> Result<()> {
        let device = &self.device;
        let slot = &mut self.slots[slot];
        if slot.times.lock().expect("no panic while times are stored").is_some() {
            return Ok(());
        }
        let labels = std::mem::take(&mut slot.labels);
        let mut works = std::mem::take(&mut slot.works);
        if let Some(statistics) = slot.statistics {
            Work::add_statistics(device, statistics, &mut works)?;
        }
        let mut stamps = vec![0u64; 2 * labels.len()];
        if !stamps.is_empty() && device.timestamp_bits > 0 {
            // SAFETY: the frame has ended, and wrote 2 timestamps per label.
            unsafe {
                device.handle.get_query_pool_results(
                    slot.queries,
                    0,
                    &mut stamps,
                    vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
                )
            }
            .check("vkGetQueryPoolResults", "timestamps")?;
        }
        // Counters narrower than 64 bits wrap, so the difference is masked.
        let mask = u64::MAX.checked_shr(64 - device.timestamp_bits).unwrap_or(0);
        let period_ns = f64::from(device.physical.limits.timestamp_period);
        let times = labels.into_iter().enumerate().map(|(n, label)| {
            let ticks = stamps[2 * n + 1].wrapping_sub(stamps[2 * n]) & mask;
            let ns = (device.timestamp_bits > 0).then_some((ticks as f64 * period_ns) as u64);
            PassTime { label, ns, work: works.get(n).copied() }
        });
        *slot.times.lock().expect("no panic while times are stored") = Some(times.collect());
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
            .query_count(2 * MOST_PASSES as u32);
        // SAFETY: the device lives. A failure half-way leaks a pool, but ends the program.
        unsafe {
            let pool =
                device.handle.create_command_pool(&pool_info, None).check("vkCreateCommandPool", "frame")?;
            let buffers = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let buffer = device
                .handle
                .allocate_command_buffers(&buffers)
                .check("vkAllocateCommandBuffers", "frame")?[0];
            let descriptors = Descriptors::new(device)?;
            let queries =
                device.handle.create_query_pool(&query_info, None).check("vkCreateQueryPool", "frame")?;
            let statistics = match device.features.contains(&Feature::PipelineStatistics) {
                true => {
                    let info = statistics_info(MOST_PASSES as u32);
                    Some(device.handle.create_query_pool(&info, None).check("vkCreateQueryPool", "frame")?)
                }
                false => None,
            };
            device.name(pool, "frame commands");
            device.name(buffer, "frame");
            device.name(queries, "frame timestamps");
            Ok(Slot {
                pool,
                buffer,
                descriptors,
                queries,
                statistics,
                labels: Vec::new(),
                works: Vec::new(),
                value: 0,
                times: Times::default(),
            })
        }
    }
}

impl Gpu {
    /// Starts the next frame. Waits until the GPU has finished the frame [`FRAMES_IN_FLIGHT`] before it. Only
    /// one frame is recorded at a time: other threads wait for its submission. The recording thread must
    /// submit or drop its frame before it starts another, creates a filled buffer or waits for a ticket.
    /// Otherwise it waits for itself.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn frame(&self) -> Result<Frame<'_>> {
        let mut ring = self.ring.lock().expect("no panic while a frame is recorded");
        let slot = (ring.submitted % FRAMES_IN_FLIGHT as u64) as usize;
        let value = ring.slots[slot].value;
        ring.wait(value)?;
        ring.read_times(slot)?;
        self.device.collect(self.device.finished()?, Some(ring.submitted + 1));
        ring.slots[slot].times = Times::default();
        let mut frame = Frame { ring, gpu: self, slot, submitted: false, transitions: Vec::new() };
        frame.begin()?;
        Ok(frame)
    }
}

impl Gpu {
    /// Enables or disables counting of the passes' work, from the next frame on. Pipeline statistics cost
    /// time on some devices.
    ///
    /// # Panics
    /// If `counting` is true and the device was opened without [`Feature::PipelineStatistics`].
    pub fn count_work(&self, counting: bool) {
        assert!(!counting || self.has(Feature::PipelineStatistics), "opened without pipeline statistics");
        self.ring.lock().expect("no panic while a frame is recorded").counting = counting;
    }
}

impl Frame<'_> {
    fn begin(&mut self) -> Result<()> {
        let device = &self.gpu.device;
        let slot = &mut self.ring.slots[self.slot];
        slot.descriptors.reset(device)?;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the GPU has passed the slot's last use; the ring is locked.
        unsafe {
            device
                .handle
                .reset_command_pool(slot.pool, vk::CommandPoolResetFlags::empty())
                .check("vkResetCommandPool", "frame")?;
            device.handle.reset_query_pool(slot.queries, 0, 2 * MOST_PASSES as u32);
            if let Some(statistics) = slot.statistics {
                device.handle.reset_query_pool(statistics, 0, MOST_PASSES as u32);
            }
            device.handle.begin_command_buffer(slot.buffer, &begin).check("vkBeginCommandBuffer", "frame")?;
        }
        Ok(())
    }

    /// Transitions the images created since the last pass to GENERAL, where they stay.
    fn flush_new_images(&mut self) {
        let device = &self.gpu.device;
        let new_images =
            std::mem::take(&mut *device.new_images.lock().expect("no panic while a barrier is stored"));
        if new_images.is_empty() {
            return;
        }
        let barrier = vk::DependencyInfo::default().image_memory_barriers(&new_images);
        // SAFETY: the images live: dropping one removes its barrier from the list.
        unsafe { device.handle.cmd_pipeline_barrier2(self.ring.slots[self.slot].buffer, &barrier) };
        self.transitions.extend(new_images);
    }

    /// Transitions an acquired swapchain image to GENERAL and discards its content. The submission must wait
    /// for the semaphore of its acquisition.
    pub fn begin_present(&mut self, image: &Image) {
        self.present_barrier(image, vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
    }

    /// Transitions the image to the layout for presentation.
    pub fn end_present(&mut self, image: &Image) {
        self.present_barrier(image, vk::ImageLayout::GENERAL, vk::ImageLayout::PRESENT_SRC_KHR);
    }

    fn present_barrier(&mut self, image: &Image, from: vk::ImageLayout, to: vk::ImageLayout) {
        let all = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
        // ALL_COMMANDS: the submission waits for the acquisition at that stage, so the layout transition
        // waits too.
        let barrier = [vk::ImageMemoryBarrier2::default()
            .image(image.handle)
            .old_layout(from)
            .new_layout(to)
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(all)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(all)
            .subresource_range(image.whole())];
        let dependency = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        let buffer = self.ring.slots[self.slot].buffer;
        // SAFETY: recording into the frame's own buffer; the swapchain keeps the image.
        unsafe { self.gpu.device.handle.cmd_pipeline_barrier2(buffer, &dependency) };
    }

    /// Records one pass. Its commands must be independent of each other, or separated by [`Cmd::sync`].
    ///
    /// # Errors
    /// The error of `record`.
    pub fn pass<T>(&mut self, label: &str, record: impl FnOnce(&mut Cmd<'_>) -> Result<T>) -> Result<T> {
        self.flush_new_images();
        let device = &*self.gpu.device;
        let counting = self.ring.counting;
        let slot = &mut self.ring.slots[self.slot];
        assert!(slot.labels.len() < MOST_PASSES, "{label:?} is pass {} of a frame", slot.labels.len() + 1);
        let query = slot.labels.len() as u32;
        slot.labels.push(label.to_string());
        let statistics = slot.statistics.filter(|_| counting);
        let mut cmd =
            Cmd { device, handle: slot.buffer, descriptors: &mut slot.descriptors, work: Work::default() };
        cmd.begin_label(label);
        // The timestamp precedes the barrier. llvmpipe queues a timestamp with the rasterisation. Without a
        // barrier after it, llvmpipe takes it only after the pass's vertex work: 35 ms of transform feedback
        // were reported as 0.04 ms.
        cmd.timestamp(slot.queries, 2 * query);
        cmd.sync();
        if let Some(statistics) = statistics {
            cmd.begin_statistics(statistics, query);
        }
        let result = record(&mut cmd);
        if let Some(statistics) = statistics {
            cmd.end_statistics(statistics, query);
            slot.works.push(cmd.work);
        }
        cmd.timestamp(slot.queries, 2 * query + 1);
        cmd.end_label();
        result
    }

    /// Ends the recording and submits the frame. The host may read the frame's read-back buffers once
    /// [`Ticket::wait`] has returned.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn submit(self) -> Result<Ticket> {
        self.submit_between(&[], &[])
    }

    /// As [`Frame::submit`], but the GPU starts once all of `waits` are signalled, and signals all of
    /// `signals` at the end. The semaphores must live until the frame has ended.
    ///
    /// # Errors
    /// As [`Frame::submit`].
    pub fn submit_between(mut self, waits: &[&Semaphore], signals: &[&Semaphore]) -> Result<Ticket> {
        let device = &self.gpu.device;
        let value = self.ring.submitted + 1;
        let buffer = self.ring.slots[self.slot].buffer;
        let to_host = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&to_host);
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(buffer)];
        let semaphore = |handle| {
            vk::SemaphoreSubmitInfo::default()
                .semaphore(handle)
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        };
        let waits: Vec<_> = waits.iter().map(|wait| semaphore(wait.handle)).collect();
        let mut signals: Vec<_> = signals.iter().map(|signal| semaphore(signal.handle)).collect();
        signals.push(semaphore(device.timeline).value(value));
        let submit = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(&signals)];
        // SAFETY: recording is complete; every object named by it is kept until the timeline passes `value`.
        unsafe {
            device.handle.cmd_pipeline_barrier2(buffer, &dependency);
            device.handle.end_command_buffer(buffer).check("vkEndCommandBuffer", "frame")?;
            device
                .handle
                .queue_submit2(device.queue, &submit, vk::Fence::null())
                .check("vkQueueSubmit2", &self.ring.slots[self.slot].labels.join(", "))?;
        }
        self.ring.submitted = value;
        self.submitted = true;
        let slot = self.slot;
        self.ring.slots[slot].value = value;
        Ok(Ticket { gpu: self.gpu.clone(), value, slot, times: self.ring.slots[slot].times.clone() })
    }
}

impl Drop for Frame<'_> {
    fn drop(&mut self) {
        if !self.submitted {
            // The frame wrote no timestamps, so none may be read.
            self.ring.slots[self.slot].labels.clear();
            self.ring.slots[self.slot].works.clear();
            let mut new_images =
                self.gpu.device.new_images.lock().expect("no panic while a barrier is stored");
            new_images.append(&mut self.transitions);
        }
    }
}

impl Ticket {
    /// Waits for the frame and returns the time of each pass, in order.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn wait(&self) -> Result<Vec<PassTime>> {
        let mut ring = self.gpu.ring.lock().expect("no panic while a frame is recorded");
        ring.wait(self.value)?;
        let stored = self.times.lock().expect("no panic while times are stored").clone();
        if let Some(times) = stored {
            return Ok(times);
        }
        assert_eq!(
            ring.slots[self.slot].value, self.value,
            "a slot is used again only after its times are read"
        );
        ring.read_times(self.slot)?;
        let times = self.times.lock().expect("no panic while times are stored").clone();
        times.ok_or_else(|| Error::Limit { object: "frame".into(), what: "no times were kept".into() })
    }
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
