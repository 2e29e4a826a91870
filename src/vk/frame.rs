//! A frame: a short list of passes, in a ring of [`super::FRAMES_IN_FLIGHT`].
//!
//! `pass` = debug label + timestamp + one global memory barrier + the closure + timestamp + end of label. No pass
//! declares what it reads or writes, so no dependency can be forgotten. Passes never overlap, so their times add up.

use super::command::Cmd;
use super::ring::{MAX_PASSES, PassTime, Ring, Slot, Times};
use super::used::Listing;
use super::{Check, Error, Feature, Gpu, Image, PassResources, Result, Semaphore, Work};
use ash::vk;
use std::sync::MutexGuard;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// What a closure that records a pass returns: `()` if its commands cannot fail, or a [`Result`].
pub trait Recorded {
    type Output;

    /// # Errors
    /// The error of the recording.
    fn result(self) -> Result<Self::Output>;
}

impl Recorded for () {
    type Output = ();

    fn result(self) -> Result<()> {
        Ok(())
    }
}

impl<T> Recorded for Result<T> {
    type Output = T;

    fn result(self) -> Result<T> {
        self
    }
}

/// A frame that is being recorded.
pub struct Frame<'a> {
    gpu: &'a Gpu,
    /// Taken when the frame ends.
    slot: Option<Slot>,
    counting: bool,
    /// The passes so far, if the frame lists their resources.
    listed: Option<Vec<PassResources>>,
}

/// A submitted frame.
pub struct Ticket {
    gpu: Gpu,
    value: u64,
    times: Times,
}

impl Gpu {
    /// Starts a frame. Waits until the GPU has finished the frame [`super::FRAMES_IN_FLIGHT`] before it. Frames run in
    /// the order of their submissions; several can be recorded at a time, on one thread or on several.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn frame(&self) -> Result<Frame<'_>> {
        let mut ring = self.lock_ring();
        // Other threads may submit frames during the wait, and take the slot.
        loop {
            let awaited = ring.frees_slot()?;
            if self.device.waited.load(Ordering::SeqCst) >= awaited {
                break;
            }
            drop(ring);
            self.device.wait(awaited)?;
            ring = self.lock_ring();
        }
        ring.slots[0].read_times(&self.device)?;
        self.device.collect(self.device.finished()?);
        self.device.objects().recording += 1;
        let listed = ring.listing.then(Vec::new);
        let mut frame = Frame { gpu: self, slot: ring.slots.pop_front(), counting: ring.counting, listed };
        drop(ring);
        frame.slot().begin(&self.device)?;
        Ok(frame)
    }

    /// Runs one pass as a frame of its own and waits for it.
    ///
    /// # Errors
    /// The error of `record`; [`Error::DeviceLost`].
    pub fn run_pass<R: Recorded>(
        &self,
        label: &str,
        record: impl FnOnce(&mut Cmd<'_>) -> R,
    ) -> Result<Vec<PassTime>> {
        let mut frame = self.frame()?;
        frame.pass(label, record)?;
        frame.submit()?.wait()
    }

    /// The time that all threads together have waited for this device so far.
    pub fn waited(&self) -> Duration {
        Duration::from_nanos(self.device.waited_ns.load(Ordering::Relaxed))
    }

    pub(super) fn lock_ring(&self) -> MutexGuard<'_, Ring> {
        self.ring.lock().expect("no panic under the ring's lock")
    }

    /// Enables or disables counting of the passes' work, from the next frame on. Pipeline statistics cost
    /// time on some devices.
    ///
    /// # Panics
    /// If `counting` is true and the device was opened without [`Feature::PipelineStatistics`].
    pub fn count_work(&self, counting: bool) {
        assert!(!counting || self.has(Feature::PipelineStatistics), "opened without pipeline statistics");
        self.lock_ring().counting = counting;
    }

    /// Enables or disables the lists of [`Frame::resources`], from the next frame on. They cost host time.
    pub fn list_resources(&self, listing: bool) {
        self.lock_ring().listing = listing;
    }
}

impl Frame<'_> {
    fn slot(&mut self) -> &mut Slot {
        self.slot.as_mut().expect("the frame has not ended")
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
        // The submission waits for the acquisition at ALL_COMMANDS, the barrier's first stage, so the layout
        // transition waits too.
        let barrier = [image.barrier(from, to)];
        let dependency = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        let buffer = self.slot().buffer;
        // SAFETY: recording into the frame's own buffer; the swapchain keeps the image.
        unsafe { self.gpu.device.handle.cmd_pipeline_barrier2(buffer, &dependency) };
    }

    /// Records one pass. Its commands must be independent of each other, or separated by [`Cmd::sync`].
    ///
    /// # Errors
    /// The error of `record`.
    pub fn pass<R: Recorded>(
        &mut self,
        label: &str,
        record: impl FnOnce(&mut Cmd<'_>) -> R,
    ) -> Result<R::Output> {
        let (device, counting, lists) = (&*self.gpu.device, self.counting, self.listed.is_some());
        let slot = self.slot();
        assert!(slot.labels.len() < MAX_PASSES, "{label:?} is pass {} of a frame", slot.labels.len() + 1);
        let query = slot.labels.len() as u32;
        slot.labels.push(label.to_string());
        let statistics = slot.statistics.filter(|_| counting);
        let mut cmd = Cmd {
            device,
            handle: slot.buffer,
            descriptors: &mut slot.descriptors,
            mapped: &mut slot.mapped,
            work: Work::default(),
            listing: lists.then(Listing::default),
        };
        cmd.begin_label(label);
        // The timestamp precedes the barrier. llvmpipe queues a timestamp with the rasterisation. Without a
        // barrier after it, llvmpipe takes it only after the pass's vertex work: 35 ms of transform feedback
        // were reported as 0.04 ms.
        cmd.timestamp(slot.queries, 2 * query);
        cmd.sync();
        if let Some(statistics) = statistics {
            cmd.begin_statistics(statistics, query);
        }
        let result = record(&mut cmd).result();
        if let Some(statistics) = statistics {
            cmd.end_statistics(statistics, query);
            slot.works.push(cmd.work);
        }
        cmd.timestamp(slot.queries, 2 * query + 1);
        cmd.end_label();
        let listing = cmd.listing.take();
        if let (Some(passes), Some(listing)) = (&mut self.listed, listing) {
            passes.push(listing.into_pass(label));
        }
        result
    }

    /// The buffers and images of the passes that were recorded so far; empty unless [`Gpu::list_resources`] asked for
    /// them.
    pub fn resources(&self) -> &[PassResources] {
        self.listed.as_deref().unwrap_or_default()
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
        let slot = self.slot.as_mut().expect("the frame has not ended");
        slot.end(device)?;
        let semaphore = |handle| {
            vk::SemaphoreSubmitInfo::default()
                .semaphore(handle)
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        };
        let waits: Vec<_> = waits.iter().map(|wait| semaphore(wait.handle)).collect();
        let mut signals: Vec<_> = signals.iter().map(|signal| semaphore(signal.handle)).collect();
        let mut ring = self.gpu.lock_ring();
        let mut objects = device.objects();
        let value = ring.submitted + 1;
        signals.push(semaphore(device.timeline).value(value));
        slot.mapped.iter().for_each(|buffer| buffer.submit(value));
        let commands = slot.commands(device, &objects.new_images)?;
        let submit = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(&signals)];
        // SAFETY: recording is complete; every object named by it is kept until the timeline passes `value`.
        unsafe { device.handle.queue_submit2(device.queue, &submit, vk::Fence::null()) }
            .check("vkQueueSubmit2", &slot.labels.join(", "))?;
        objects.new_images.clear();
        objects.end_recording(value);
        slot.value = value;
        let ticket = Ticket { gpu: self.gpu.clone(), value, times: slot.times.clone() };
        ring.submitted = value;
        ring.slots.extend(self.slot.take());
        Ok(ticket)
    }
}

impl Drop for Frame<'_> {
    fn drop(&mut self) {
        if let Some(mut slot) = self.slot.take() {
            let mut ring = self.gpu.lock_ring();
            slot.mapped.iter().for_each(|buffer| buffer.withdraw(ring.submitted));
            // The frame wrote no timestamps, so none may be read.
            slot.forget_frame();
            ring.slots.push_front(slot);
            self.gpu.device.objects().end_recording(ring.submitted);
        }
    }
}

impl Ticket {
    /// Waits for the frame and returns the time of each pass, in order.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn wait(&self) -> Result<Vec<PassTime>> {
        // Waits without the ring's lock, so that other threads can submit frames meanwhile.
        self.gpu.device.wait(self.value)?;
        let mut ring = self.gpu.lock_ring();
        // A slot is used again only after its times are read.
        if let Some(slot) = ring.slots.iter_mut().find(|slot| slot.value == self.value) {
            slot.read_times(&self.gpu.device)?;
        }
        let times = self.times.get().cloned();
        times.ok_or_else(|| Error::limit("frame", "no times were kept"))
    }
}
