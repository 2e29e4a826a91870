//! Frames of one scene: the list of the frame before last is streamed, the next frame is drawn, and what each frame
//! found out is kept. Everything of paper 1 at work together; the steps stand in the files beside this folder.

mod compare;
mod dump;
mod record;

pub use compare::PlainComparison;
pub use dump::{FootprintPicture, read_u1, read_words};
pub use record::FrameRecord;

pub use crate::picture::Target;

pub use super::config::{Settings, needs};
use super::feedback::{self, Memory};
use super::pipeline::{Finished, Pipeline};
use super::resident::ResidentError;
use super::scout::Scout;
use super::streaming::{FrameReport, Streaming, StreamingError, distinct_tiles};
use super::{Filtering, Listing, Unfit, surface};
use crate::math::camera::Pose;
use crate::model::mesh::Mesh;
use crate::scene::camera::continued;
use crate::texture::source::TileSource;
use crate::vk::shader::View;
use crate::vk::{self, FRAMES_IN_FLIGHT, Gpu, Image, ImageInfo};
use record::Lists;
use std::sync::Arc;
use std::time::{Duration, Instant};
use thiserror::Error;

/// What can stop a picture.
#[derive(Debug, Error)]
pub enum SessionError {
    #[error(transparent)]
    Vulkan(#[from] vk::Error),
    #[error(transparent)]
    Resident(#[from] ResidentError),
    #[error(transparent)]
    Variants(#[from] Unfit),
    #[error(transparent)]
    Streaming(#[from] StreamingError),
    #[error(
        "filter.max_anisotropy = {wanted}: samples reach as many texels beyond a tile's edge, and the texture's border has {border}; lower it, bake a wider border, or take filter.kind = \"stochastic\""
    )]
    Anisotropy { wanted: u32, border: u32 },
    #[error(
        "{pending} visible tiles have not arrived for {} s; see the report's queues, or raise the load budget",
        STALL.as_secs()
    )]
    Stalled { pending: usize },
}

impl SessionError {
    /// The program's exit code where it is not the common 1.
    pub fn exit_code(&self) -> Option<u8> {
        match self {
            SessionError::Vulkan(error) | SessionError::Resident(ResidentError::Vulkan(error)) => {
                Some(error.exit_code())
            }
            // G1 lies in the same file as the tiles: what cannot be read there is damage.
            SessionError::Resident(ResidentError::Source(_)) => Some(3),
            _ => None,
        }
    }
}

/// Nothing loaded and nothing copied for so long: something is broken, and waiting will not mend it. A source may
/// take seconds for one tile, not a minute.
const STALL: Duration = Duration::from_secs(60);

/// Runs the frames of one scene on one device.
pub struct Session {
    pub gpu: Gpu,
    pub source: Arc<dyn TileSource>,
    pub pipeline: Pipeline,
    pub streaming: Streaming,
    pub settings: Settings,
    target: Image,
    /// Frames that have ended, in order; those in flight are added by [`Session::drain`].
    pub records: Vec<FrameRecord>,
    in_flight: Vec<(FrameReport, Option<u64>)>,
    /// Lists that [`Session::drain`] took before their time.
    drained: [Option<Lists>; FRAMES_IN_FLIGHT],
    /// Where the list is subsampled.
    samples_seen: Option<Memory>,
    scout: Option<Scout>,
    last_pose: Option<Pose>,
    next: u64,
    pose: Option<(Pose, u64)>,
    bias: u32,
}

impl Session {
    /// # Errors
    /// What the device lacks, settings with which nothing could be shown, a texture whose coarsest levels cannot be
    /// read.
    pub fn new(
        gpu: Gpu,
        source: Arc<dyn TileSource>,
        mesh: &Mesh,
        settings: Settings,
    ) -> Result<Session, SessionError> {
        settings.config.check(&source.pyramid())?;
        for need in needs(&settings.config, source.format()) {
            let feature = need.feature;
            assert!(gpu.has(feature), "the device was opened without {feature:?}: give it renderer::needs");
        }
        // The outermost of nA samples lies nA - 1 texels from the pixel's own, and each mixes half a texel more; the
        // taps of the stochastic filter find their tiles themselves.
        let (wanted, border) = (settings.config.filter.max_anisotropy, source.pyramid().border_texels());
        if wanted > 1 && wanted > border && settings.config.filter.kind != Filtering::Stochastic {
            return Err(SessionError::Anisotropy { wanted, border });
        }
        let target = gpu.image("picture", ImageInfo::target(settings.size, settings.target.into()))?;
        let streaming = Streaming::new(source.clone(), settings.streaming.clone())?;
        let bias = settings.streaming.level_bias;
        let counts = [settings.streaming.gpu_tiles, settings.streaming.upload_tiles_per_frame];
        let samples_seen = (settings.config.list == Listing::Feedback)
            .then(|| Memory::new(feedback::cycle(settings.config.feedback_log2)));
        let pipeline = Pipeline::new(&gpu, &*source, mesh, &settings.config, &target, counts)?;
        let scout = match settings.streaming.prefetch_frames {
            0 => None,
            _ => Some(Scout::new(&gpu, &source.pyramid(), &settings.config, settings.size)?),
        };
        Ok(Session {
            scout,
            last_pose: None,
            gpu,
            source,
            pipeline,
            streaming,
            settings,
            target,
            records: Vec::new(),
            in_flight: Vec::new(),
            drained: Default::default(),
            samples_seen,
            next: 0,
            pose: None,
            bias,
        })
    }

    /// One frame from `pose`: takes the list of the frame [`FRAMES_IN_FLIGHT`] before, streams, draws.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn frame(&mut self, pose: &Pose) -> Result<(), SessionError> {
        let flight = (self.next % FRAMES_IN_FLIGHT as u64) as usize;
        let lists = match self.drained[flight].take() {
            Some(lists) => Some(lists),
            None => self.finish(flight)?,
        };
        let Session { gpu, pipeline, streaming, bias, .. } = self;
        let report = pipeline.gather(gpu, flight, |uploader| match &lists {
            // Nothing is known yet: the bias stays.
            None => (Vec::new(), FrameReport { bias: *bias, ..FrameReport::default() }),
            Some(Lists { visible, ahead }) => {
                let mut report = streaming.frame_ahead(visible, ahead, uploader);
                (std::mem::take(&mut report.display), report)
            }
        })?;
        if report.bias != self.bias {
            let bias = report.bias;
            let why = if report.oversubscribed { "the visible tiles exceed N1" } else { "they fit N1" };
            tracing::info!("frame {}: level bias {} -> {bias}: {why}", self.next, self.bias);
            self.bias = bias;
        }
        let view = surface::view(pose, self.settings.size, self.bias);
        let view = View { frame: self.next as u32, ..view };
        let mut frame = self.gpu.frame()?;
        self.pipeline.record(&mut frame, flight, &view, &self.target)?;
        if let Some(scout) = &mut self.scout {
            let frames = self.settings.streaming.prefetch_frames;
            let ahead = self.last_pose.and_then(|last| continued(&last, pose, frames));
            scout.record(&mut frame, flight, &self.pipeline.surface, ahead.as_ref())?;
        }
        self.last_pose = Some(*pose);
        self.pipeline.submitted(flight, frame.submit()?);
        let list_of = lists.is_some().then(|| self.next - FRAMES_IN_FLIGHT as u64);
        self.in_flight.push((report, list_of));
        if self.pose.is_none_or(|(last, _)| last != *pose) {
            self.pose = Some((*pose, self.next));
        }
        self.next += 1;
        Ok(())
    }

    /// Takes what the frame in place `flight` found out.
    fn finish(&mut self, flight: usize) -> Result<Option<Lists>, SessionError> {
        let Some(Finished { triples, overflowed, times, host_time }) =
            self.pipeline.finish(&self.gpu, flight)?
        else {
            return Ok(None);
        };
        let first_resident = self.source.pyramid().first_resident_level();
        let start = Instant::now();
        let distinct = |triples: &[_]| distinct_tiles(triples, self.settings.config.keying, first_resident);
        let seen = distinct(&triples);
        let visible = match &mut self.samples_seen {
            Some(memory) => memory.add(&seen),
            None => seen,
        };
        let ahead = match &mut self.scout {
            Some(scout) => distinct(&scout.collect(&self.gpu, flight)?),
            None => Vec::new(),
        };
        let index = self.next - self.in_flight.len() as u64;
        let (streaming, list_of) = self.in_flight.remove(0);
        self.records.push(FrameRecord {
            index,
            streaming,
            list_of,
            passes: times,
            host_list: host_time + start.elapsed(),
            triples: triples.len(),
            visible: visible.clone(),
            ahead: ahead.clone(),
            overflowed,
        });
        Ok(Some(Lists { visible, ahead }))
    }

    /// Waits for every frame in flight, so that [`Session::records`] holds all of them. Their lists are kept for
    /// the frames that will stream them: a picture taken on the way changes nothing that follows.
    ///
    /// # Errors
    /// Device lost.
    pub fn drain(&mut self) -> Result<(), SessionError> {
        for n in self.next..self.next + FRAMES_IN_FLIGHT as u64 {
            let flight = (n % FRAMES_IN_FLIGHT as u64) as usize;
            if let Some(lists) = self.finish(flight)? {
                self.drained[flight] = Some(lists);
            }
        }
        Ok(())
    }

    /// Whether the last frame's picture has all the tiles that its pose needs (unreadable ones apart), and no
    /// frame is missing from the knowledge of that.
    pub fn settled(&self) -> bool {
        let Some((_, since)) = self.pose else { return false };
        // The list that the last frame streamed came from the frame FRAMES_IN_FLIGHT before it.
        let listed = self.next > since + FRAMES_IN_FLIGHT as u64 + self.frames_to_list() - 1;
        listed && self.streaming.settled() && self.pipeline.faded_in()
    }

    /// Frames until a camera that stands still has listed all it sees.
    pub fn frames_to_list(&self) -> u64 {
        self.samples_seen.as_ref().map_or(1, Memory::frames)
    }

    /// Frames from one pose until nothing is missing; returns how many it took.
    ///
    /// # Errors
    /// [`SessionError::Stalled`], and all of [`Session::frame`].
    pub fn settle(&mut self, pose: &Pose) -> Result<u64, SessionError> {
        let first = self.next;
        let mut progress = Instant::now();
        loop {
            self.frame(pose)?;
            if self.settled() {
                return Ok(self.next - first);
            }
            let (report, _) = self.in_flight.last().expect("a frame was just handed over");
            if report.loads + report.uploads + report.failures.len() > 0 {
                progress = Instant::now();
            }
            let pending = report.pending;
            if self.next > first + FRAMES_IN_FLIGHT as u64 + self.frames_to_list()
                && progress.elapsed() > STALL
            {
                return Err(SessionError::Stalled { pending });
            }
        }
    }

    /// Levels by which the last frame's tiles were coarser than asked for.
    pub fn bias(&self) -> u32 {
        self.bias
    }

    /// The image that frames are drawn into.
    pub fn target(&self) -> &Image {
        &self.target
    }

    /// The last frame's picture, rows from the top: sRGB bytes or f32 of linear light, RGBA.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn picture_bytes(&mut self) -> Result<Vec<u8>, SessionError> {
        self.drain()?;
        Ok(self.gpu.read_image(&self.target)?)
    }

    /// (name, bytes) of all that the scene made in video memory.
    pub fn memory(&self) -> Vec<(&'static str, u64)> {
        let mut memory = self.pipeline.memory();
        memory.push(("picture", self.target.bytes()));
        memory.extend(self.scout.as_ref().map(|scout| ("scout", scout.bytes())));
        memory
    }
}
