//! The frame loop.

use super::{Memory, PerFrame, Progress, Records, STALL, Slot, Stalled, Target, Technique, View};
use crate::math::camera::Pose;
use crate::picture;
use crate::vk::{self, FRAMES_IN_FLIGHT, Frame, Gpu, Semaphore, Ticket};
use std::time::Instant;

/// Runs the frames of a technique on one device, into one target.
pub struct Run<T: Technique> {
    pub gpu: Gpu,
    pub technique: T,
    /// Frames that have ended; [`Run::drain`] adds those in flight.
    pub records: Records<T::Record>,
    target: Target,
    in_flight: PerFrame<Option<Ticket>>,
    next: u64,
}

impl<T: Technique> Run<T> {
    /// Frames of `technique`, which was made for `target`. Keeps all records: see [`Run::keep`].
    pub fn new(gpu: Gpu, technique: T, target: Target) -> Run<T> {
        for need in technique.needs() {
            let feature = need.feature;
            assert!(
                gpu.has(feature),
                "the device was opened without {feature:?}, which {:?} needs",
                need.pass
            );
        }
        let (records, in_flight) = (Records::all(), PerFrame::default());
        Run { gpu, technique, records, target, in_flight, next: 0 }
    }

    /// From here on records go to `records`.
    pub fn keep(&mut self, records: Records<T::Record>) {
        self.records = records;
    }

    /// One frame from `pose`.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn frame(&mut self, pose: &Pose) -> Result<(), T::Error> {
        self.frame_between(pose, &[], &[])
    }

    /// As [`Run::frame`]: the device begins when all of `waits` are signalled, and signals all of `signals` at the end.
    ///
    /// # Errors
    /// As [`Run::frame`].
    pub fn frame_between(
        &mut self,
        pose: &Pose,
        waits: &[&Semaphore],
        signals: &[&Semaphore],
    ) -> Result<(), T::Error> {
        self.frame_with(pose, waits, signals, |_, _| Ok(()))
    }

    /// As [`Run::frame_between`]; `also` records passes behind those of the technique: what shows the picture in a window.
    ///
    /// # Errors
    /// As [`Run::frame`], and what `also` returns.
    pub fn frame_with(
        &mut self,
        pose: &Pose,
        waits: &[&Semaphore],
        signals: &[&Semaphore],
        also: impl FnOnce(&mut Frame<'_>, &Target) -> vk::Result<()>,
    ) -> Result<(), T::Error> {
        let view = View { pose: *pose, size: self.target.size(), frame: self.next };
        self.retire(view.slot())?;
        self.technique.prepare(&self.gpu, &view)?;
        let mut frame = self.gpu.frame()?;
        self.technique.record(&mut frame, &view, &self.target)?;
        also(&mut frame, &self.target)?;
        self.in_flight[view.slot()] = Some(frame.submit_between(waits, signals)?);
        self.next += 1;
        Ok(())
    }

    /// Waits for the last frame in `slot`, and keeps its record.
    fn retire(&mut self, slot: Slot) -> Result<(), T::Error> {
        let Some(ticket) = self.in_flight[slot].take() else { return Ok(()) };
        let times = ticket.wait()?;
        self.records.push(self.technique.retire(&self.gpu, slot, times)?);
        Ok(())
    }

    /// Waits for every frame in flight, so that [`Run::records`] holds all of them. It changes nothing that follows.
    ///
    /// # Errors
    /// Device lost.
    pub fn drain(&mut self) -> Result<(), T::Error> {
        (self.next..self.next + FRAMES_IN_FLIGHT as u64).try_for_each(|frame| self.retire(Slot::of(frame)))
    }

    /// Whether the last frame's picture is complete.
    pub fn settled(&self) -> bool {
        self.next > 0 && self.technique.progress() == Progress::Settled
    }

    /// Frames from one pose until nothing is missing; returns how many it took.
    ///
    /// # Errors
    /// [`Stalled`], and all of [`Run::frame`].
    pub fn settle(&mut self, pose: &Pose) -> Result<u64, T::Error> {
        let first = self.next;
        let mut last_arrival = Instant::now();
        loop {
            self.frame(pose)?;
            match self.technique.progress() {
                Progress::Settled => return Ok(self.next - first),
                Progress::Waiting { pending } if last_arrival.elapsed() > STALL => {
                    return Err(Stalled { pending }.into());
                }
                Progress::Waiting { .. } => {}
                Progress::Arriving => last_arrival = Instant::now(),
            }
        }
    }

    /// Frames are of `size` pixels from now on.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), T::Error> {
        self.drain()?;
        self.target = Target::new(&self.gpu, size, self.target.kind)?;
        self.technique.resize(&self.gpu, &self.target)
    }

    /// Changes the technique between two frames; no frame is in flight.
    ///
    /// # Errors
    /// Device lost, and what `change` returns.
    pub fn reconfigure(
        &mut self,
        change: impl FnOnce(&mut T, &Gpu, &Target) -> Result<(), T::Error>,
    ) -> Result<(), T::Error> {
        self.drain()?;
        change(&mut self.technique, &self.gpu, &self.target)
    }

    pub fn target(&self) -> &Target {
        &self.target
    }

    /// Pixels.
    pub fn size(&self) -> [u32; 2] {
        self.target.size()
    }

    /// What [`Run::picture_bytes`] are.
    pub fn kind(&self) -> picture::Target {
        self.target.kind
    }

    /// The last frame's picture, rows from the top: sRGB bytes or f32 of linear light, RGBA.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn picture_bytes(&mut self) -> Result<Vec<u8>, T::Error> {
        self.drain()?;
        Ok(self.gpu.read_image(&self.target.color)?)
    }

    /// Of the technique, and of the target.
    pub fn memory(&self) -> Memory {
        let target = [("depth", self.target.depth.bytes()), ("picture", self.target.color.bytes())];
        let target = target.map(|(name, bytes)| (name.to_owned(), bytes));
        self.technique.memory().into_iter().chain(target).collect()
    }
}
