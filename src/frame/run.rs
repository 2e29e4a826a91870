//! The frame loop.

use super::{
    Allocations, FRAME_SECONDS, FrameSlot, PerFrame, Progress, Records, STALL, Stalled, Target, Technique,
    View,
};
use crate::math::camera::Pose;
use crate::picture::write::Srgb8Picture;
use crate::picture::{Picture, PixelFormat};
use crate::vk::{self, FRAMES_IN_FLIGHT, Frame, Gpu, Semaphore, Ticket};
use std::time::{Duration, Instant};

/// Runs the frames of a technique on one device, into one target.
pub struct Run<T: Technique> {
    pub gpu: Gpu,
    pub technique: T,
    /// Records of frames that have ended; [`Run::drain`] adds those in flight. Only the last
    /// [`HISTORY`](super::HISTORY) are kept, unless [`Run::keep`] was called.
    pub records: Records<T::Record>,
    /// [`Run::settle`] gives up after this wait without a new arrival; by default [`STALL`].
    pub stall: Duration,
    /// [`View::seconds`] of the next frames; by default [`FRAME_SECONDS`](super::FRAME_SECONDS), so that pictures do
    /// not depend on the speed of the machine.
    pub frame_seconds: f64,
    target: Target,
    in_flight: PerFrame<Option<Ticket>>,
    next: u64,
    /// [`View::noise`] of the next frame: the number of pictures so far. All frames of a settling picture count as one.
    noise: u64,
}

impl<T: Technique> Run<T> {
    /// Runs `technique`, created for `target`. Keeps the last records ([`Records::default`]).
    pub fn new(gpu: Gpu, technique: T, target: Target) -> Run<T> {
        for need in technique.needs() {
            let feature = need.feature;
            assert!(
                gpu.has(feature),
                "the device was opened without {feature:?}, which {:?} needs",
                need.pass
            );
        }
        Run {
            gpu,
            technique,
            records: Records::default(),
            stall: STALL,
            frame_seconds: FRAME_SECONDS,
            target,
            in_flight: PerFrame::default(),
            next: 0,
            noise: 0,
        }
    }

    /// Stores all further records in `records`.
    pub fn keep(&mut self, records: Records<T::Record>) {
        self.records = records;
    }

    /// Renders one frame from `pose`.
    ///
    /// # Errors
    /// Device lost, out of memory. The run must then be dropped: the technique may rely on commands that the device
    /// never executed.
    pub fn frame(&mut self, pose: &Pose) -> Result<(), T::Error> {
        self.frame_with(pose, &[], &[], |_, _, _, _| Ok(()))
    }

    /// Like [`Run::frame`]; the device starts when all of `waits` are signalled, and signals all of `signals` at the
    /// end. `also` records more passes after those of the technique, such as a window's.
    ///
    /// # Errors
    /// As [`Run::frame`], and errors of `also`.
    pub fn frame_with(
        &mut self,
        pose: &Pose,
        waits: &[&Semaphore],
        signals: &[&Semaphore],
        also: impl FnOnce(&mut Frame<'_>, &View, &T, &Target) -> vk::Result<()>,
    ) -> Result<(), T::Error> {
        let (size, frame, noise) = (self.target.size(), self.next, self.noise);
        let view = View { pose: *pose, size, frame, seconds: self.frame_seconds, noise };
        self.retire(view.slot())?;
        self.technique.prepare(&self.gpu, &view)?;
        let mut frame = self.gpu.frame()?;
        self.technique.record(&mut frame, &view, &self.target)?;
        also(&mut frame, &view, &self.technique, &self.target)?;
        self.in_flight[view.slot()] = Some(frame.submit_between(waits, signals)?);
        self.next += 1;
        self.noise += 1;
        Ok(())
    }

    /// Waits for the last frame in `slot`, and keeps its record.
    fn retire(&mut self, slot: FrameSlot) -> Result<(), T::Error> {
        let Some(ticket) = self.in_flight[slot].take() else { return Ok(()) };
        let times = ticket.wait()?;
        self.records.push(self.technique.retire(&self.gpu, slot, times)?);
        Ok(())
    }

    /// Waits for every frame in flight, so that [`Run::records`] holds all of them. Later frames are
    /// unaffected.
    ///
    /// # Errors
    /// Device lost.
    pub fn drain(&mut self) -> Result<(), T::Error> {
        (self.next..self.next + FRAMES_IN_FLIGHT as u64)
            .try_for_each(|frame| self.retire(FrameSlot::of(frame)))
    }

    /// True if the last frame's picture is complete.
    pub fn settled(&self) -> bool {
        self.next > 0 && self.technique.progress() == Progress::Settled
    }

    /// Renders frames from one pose until nothing is missing, without time budgets. Returns their number.
    ///
    /// # Errors
    /// [`Stalled`], and the errors of [`Run::frame`].
    pub fn settle(&mut self, pose: &Pose) -> Result<u64, T::Error> {
        self.technique.lift_budgets(true);
        let settled = self.settle_within_budgets(pose);
        self.technique.lift_budgets(false);
        settled
    }

    /// As [`Run::settle`], within the time budgets.
    ///
    /// # Errors
    /// As [`Run::settle`].
    pub fn settle_within_budgets(&mut self, pose: &Pose) -> Result<u64, T::Error> {
        let (first, mut last_arrival) = (self.next, Instant::now());
        while !self.settle_once(pose, &mut last_arrival)? {}
        Ok(self.next - first)
    }

    /// One frame of [`Run::settle_within_budgets`]; true if nothing is missing. `last_arrival` must be the current time
    /// at the first call.
    ///
    /// # Errors
    /// As [`Run::settle`].
    pub fn settle_once(&mut self, pose: &Pose, last_arrival: &mut Instant) -> Result<bool, T::Error> {
        let noise = self.noise;
        self.frame(pose)?;
        let progress = self.technique.progress();
        if progress != Progress::Settled {
            self.noise = noise;
        }
        match progress {
            Progress::Settled => return Ok(true),
            Progress::Waiting { pending } if last_arrival.elapsed() > self.stall => {
                return Err(Stalled { pending, waited: self.stall }.into());
            }
            Progress::Waiting { .. } => {}
            Progress::Arriving => *last_arrival = Instant::now(),
        }
        Ok(false)
    }

    /// Resizes the target to `size` pixels. On an error, the old size stays.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), T::Error> {
        self.drain()?;
        let target = Target::new(&self.gpu, size, self.target.kind)?;
        self.technique.resize(&self.gpu, &target)?;
        self.target = target;
        Ok(())
    }

    /// Changes the technique between two frames, with no frame in flight.
    ///
    /// # Errors
    /// Device lost, and errors of `change`.
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

    /// The format of [`Run::picture_bytes`].
    pub fn kind(&self) -> PixelFormat {
        self.target.kind
    }

    /// The last frame's picture, rows from the top, RGBA: sRGB bytes or f32 linear light.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn picture_bytes(&mut self) -> Result<Vec<u8>, T::Error> {
        self.read_picture(<[u8]>::to_vec)
    }

    /// As [`Run::picture_bytes`], but `read` receives the bytes in mapped memory: no `Vec` is made.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn read_picture<R>(&mut self, read: impl FnOnce(&[u8]) -> R) -> Result<R, T::Error> {
        self.drain()?;
        Ok(self.gpu.read_image_with(&self.target.color, read)?)
    }

    /// The last frame's picture in linear light: exact with [`PixelFormat::Linear32`], otherwise decoded from sRGB
    /// bytes.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn linear_picture(&mut self) -> Result<Picture, T::Error> {
        let [width, height] = self.size();
        Ok(match self.kind() {
            PixelFormat::Srgb8 => Picture::from(&Srgb8Picture { width, height, rgba: self.picture_bytes()? }),
            PixelFormat::Linear32 => {
                Picture::new(width, height, self.read_picture(bytemuck::pod_collect_to_vec)?)
            }
        })
    }

    /// Memory of the technique and of the target.
    pub fn memory(&self) -> Allocations {
        let target = [("depth", self.target.depth.bytes()), ("picture", self.target.color.bytes())];
        let target = target.map(|(name, bytes)| (name.to_owned(), bytes));
        self.technique.memory().into_iter().chain(target).collect()
    }
}
