//! Paper 1's part of a frame: the list of the frame before last is streamed, the shapes are drawn with what is
//! resident, and their visible tiles are listed. The steps are in the files beside this one.
//!
//! The list of frame n is used in frame n + [`FRAMES_IN_FLIGHT`]: the host never waits for a frame that it has
//! just handed over.

use super::feedback::{self, Memory as SamplesSeen};
use super::record::Lists;
use super::resident::{Resident, ResidentError, Uploads};
use super::scout::Scout;
use super::streaming::{FrameReport, Streaming, StreamingError, Uploader, distinct_tiles};
use super::{Config, Filtering, FrameRecord, Listing, Settings, Unfit, fade::FadeIn, footprint::Footprint};
use super::{method::Method, needs};
use crate::frame::{
    Draw, Memory, Onto, PerFrame, Progress, Run, Seen, Shape, Slot, Stalled, Target, Technique, View,
};
use crate::math::camera::Pose;
use crate::math::light::LightColours;
use crate::math::pyramid::TileId;
use crate::model::mesh::Mesh;
use crate::scene::camera::continued;
use crate::texture::source::TileSource;
use crate::vk::{self, FRAMES_IN_FLIGHT, Frame, Gpu, Need, PassTime};
use glam::DVec3;
use std::sync::Arc;
use std::time::Instant;
use thiserror::Error;

/// What can stop a picture.
#[derive(Debug, Error)]
pub enum VirtualTextureError {
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
    #[error(transparent)]
    Stalled(#[from] Stalled),
}

/// Paper 1's technique: one texture, on any number of shapes.
pub struct VirtualTexture {
    pub source: Arc<dyn TileSource>,
    pub settings: Settings,
    pub streaming: Streaming,
    pub resident: Resident,
    pub method: Method,
    /// What carries the texture. Those of objects may change before each frame.
    pub shapes: Vec<Shape>,
    /// Towards it, of lit shapes.
    pub sun: DVec3,
    pub onto: Onto,
    /// Streams what was visible when this was set, whatever the eye sees since.
    pub frozen: bool,
    /// The list that is streamed while frozen: the first since then, which is that of a frame before.
    frozen_list: Option<Lists>,
    scout: Option<Scout>,
    fade: FadeIn,
    uploads: PerFrame<Uploads>,
    /// Lists of frames that have ended, for the frames that will stream them.
    lists: PerFrame<Option<Lists>>,
    streamed: PerFrame<Streamed>,
    /// Where the list is subsampled.
    samples_seen: Option<SamplesSeen>,
    /// By what some shapes are lit.
    lit: Option<LightColours>,
    /// The last frame's pose, and the first frame that had it.
    pose: Option<(Pose, u64)>,
    /// Where the camera will be, if it goes on as it does.
    ahead: Option<Pose>,
    last_frame: u64,
    bias: u32,
}

/// The memory of shapes in the world, by its name in [`Technique::memory`].
pub const MESH: &str = "mesh";

/// What streaming did in a frame in flight.
#[derive(Default)]
struct Streamed {
    frame: u64,
    report: FrameReport,
    list_of: Option<u64>,
}

/// A frame's copies into video memory, as [`Streaming`] asks for them.
struct Copies<'a>(&'a mut Uploads);

impl Uploader for Copies<'_> {
    fn upload(&mut self, slot: u32, _: TileId, bytes: &[u8]) -> bool {
        self.0.tile(slot, bytes)
    }
}

impl VirtualTexture {
    /// `lit`: by what some shapes will be lit, of these or of those that come later.
    ///
    /// # Errors
    /// What the device lacks, settings with which nothing could be shown, a texture whose coarsest levels cannot be
    /// read.
    pub fn new(
        gpu: &Gpu,
        source: Arc<dyn TileSource>,
        shapes: Vec<Shape>,
        settings: Settings,
        (target, lit): (&Target, Option<LightColours>),
    ) -> Result<VirtualTexture, VirtualTextureError> {
        let pyramid = source.pyramid();
        check(&settings.config, &*source)?;
        let streaming = Streaming::new(source.clone(), settings.streaming.clone())?;
        let resident = Resident::new(gpu, &*source, settings.streaming.gpu_tiles)?;
        let most_uploads = settings.streaming.upload_tiles_per_frame;
        Ok(VirtualTexture {
            method: Method::new(gpu, &pyramid, &settings.config, &resident, target, lit)?,
            scout: scout(gpu, &*source, &settings, target)?,
            fade: FadeIn::new(settings.config.fade_in_frames),
            uploads: PerFrame::new(|| resident.uploads(gpu, most_uploads))?,
            lists: PerFrame::default(),
            streamed: PerFrame::default(),
            samples_seen: samples_seen(&settings.config),
            bias: settings.streaming.level_bias,
            lit,
            sun: DVec3::ZERO,
            onto: Onto::Cleared([0.0; 3]),
            frozen: false,
            frozen_list: None,
            pose: None,
            ahead: None,
            last_frame: 0,
            source,
            settings,
            streaming,
            resident,
            shapes,
        })
    }

    /// Frames of one mesh in the world and nothing else.
    ///
    /// # Errors
    /// As [`VirtualTexture::new`].
    pub fn run(
        gpu: Gpu,
        source: Arc<dyn TileSource>,
        mesh: &Mesh,
        settings: Settings,
    ) -> Result<Run<VirtualTexture>, VirtualTextureError> {
        check(&settings.config, &*source)?;
        let shape = match settings.config.draws_depth_alone() {
            true => Shape::with_depth_alone(&gpu, mesh)?,
            false => Shape::new(&gpu, mesh)?,
        };
        let target = Target::new(&gpu, settings.size, settings.target)?;
        let technique = VirtualTexture::new(&gpu, source, vec![shape], settings, (&target, None))?;
        Ok(Run::new(gpu, technique, target))
    }

    /// Another variant from the next frame on. The caches, and what is in them, stay.
    ///
    /// # Errors
    /// What the device lacks; a variant that does not fit the texture. The old one then stays.
    pub fn reconfigure(
        &mut self,
        gpu: &Gpu,
        config: Config,
        target: &Target,
    ) -> Result<(), VirtualTextureError> {
        check(&config, &*self.source)?;
        gpu.require(&needs(&config, self.source.format()))?;
        self.method = Method::new(gpu, &self.source.pyramid(), &config, &self.resident, target, self.lit)?;
        self.fade.set_frames(config.fade_in_frames);
        if (config.list, config.feedback_log2)
            != (self.settings.config.list, self.settings.config.feedback_log2)
        {
            self.samples_seen = samples_seen(&config);
        }
        self.settings.config = config;
        self.pose = None;
        Ok(())
    }

    /// Stage 1; a fused variant has none.
    pub fn stage1(&self) -> Option<&Footprint> {
        self.method.stage1()
    }

    /// The shapes from `pose`, as the last frame's tiles are chosen.
    pub fn seen(&self, view: View) -> Seen<'_> {
        Seen::lit(&self.shapes, view, self.bias, self.sun).onto(self.onto)
    }

    /// Levels by which the last frame's tiles were coarser than asked for.
    pub fn bias(&self) -> u32 {
        self.bias
    }

    /// The last frame's pose.
    pub(super) fn last_view(&self, size: [u32; 2]) -> View {
        let (pose, _) = self.pose.expect("asked for after a frame");
        View { pose, size, frame: self.last_frame }
    }

    /// Frames until a camera that stands still has listed all it sees.
    pub fn frames_to_list(&self) -> u64 {
        self.samples_seen.as_ref().map_or(1, SamplesSeen::frames)
    }

    /// Forgets the copies of the frame in `slot`, which has ended.
    pub(super) fn without_copies(&mut self, gpu: &Gpu, slot: Slot) -> vk::Result<()> {
        let uploads = &mut self.uploads[slot];
        uploads.clear();
        uploads.show(gpu, &mut self.resident.display, &[])
    }

    /// The passes of a frame, the prefetch apart.
    pub(super) fn record_frame(&self, frame: &mut Frame<'_>, view: &View, target: &Target) -> vk::Result<()> {
        frame.pass("upload", |cmd| {
            self.resident.copy(cmd, &self.uploads[view.slot()]);
            Ok(())
        })?;
        self.method.record(frame, &self.resident, &self.seen(*view), target)
    }

    /// The distinct tiles of a list.
    fn distinct(&self, triples: &[[u32; 3]]) -> Vec<TileId> {
        distinct_tiles(triples, self.settings.config.keying, self.source.pyramid().first_resident_level())
    }

    /// Streams the list that the frame's slot holds.
    fn stream(&mut self, gpu: &Gpu, view: &View) -> vk::Result<()> {
        let slot = view.slot();
        let uploads = &mut self.uploads[slot];
        uploads.clear();
        let mut lists = self.lists[slot].take();
        if self.frozen {
            self.frozen_list = self.frozen_list.take().or(lists);
            lists = self.frozen_list.clone();
        } else {
            self.frozen_list = None;
        }
        let mut report = match &lists {
            // Nothing is known yet: the bias stays.
            None => FrameReport { bias: self.bias, ..FrameReport::default() },
            Some(Lists { visible, ahead }) => {
                self.streaming.frame_ahead(visible, ahead, &mut Copies(uploads))
            }
        };
        let display = std::mem::take(&mut report.display);
        uploads.show(gpu, &mut self.resident.display, &self.fade.cells(&display))?;
        if report.bias != self.bias {
            let bias = report.bias;
            let why = if report.oversubscribed { "the visible tiles exceed N1" } else { "they fit N1" };
            tracing::info!("frame {}: level bias {} -> {bias}: {why}", view.frame, self.bias);
            self.bias = bias;
        }
        let list_of = lists.is_some().then(|| view.frame - FRAMES_IN_FLIGHT as u64);
        self.streamed[slot] = Streamed { frame: view.frame, report, list_of };
        Ok(())
    }
}

/// Whether the settings go together with the texture.
fn check(config: &Config, source: &dyn TileSource) -> Result<(), VirtualTextureError> {
    config.check(&source.pyramid())?;
    // The outermost of nA samples lies nA - 1 texels from the pixel's own, and each mixes half a texel more; the
    // taps of the stochastic filter find their tiles themselves.
    let (wanted, border) = (config.filter.max_anisotropy, source.pyramid().border_texels());
    if wanted > 1 && wanted > border && config.filter.kind != Filtering::Stochastic {
        return Err(VirtualTextureError::Anisotropy { wanted, border });
    }
    Ok(())
}

fn samples_seen(config: &Config) -> Option<SamplesSeen> {
    let subsampled = config.list == Listing::Feedback;
    subsampled.then(|| SamplesSeen::new(feedback::cycle(config.feedback_log2)))
}

fn scout(
    gpu: &Gpu,
    source: &dyn TileSource,
    settings: &Settings,
    target: &Target,
) -> vk::Result<Option<Scout>> {
    match settings.streaming.prefetch_frames {
        0 => Ok(None),
        _ => Scout::new(gpu, &source.pyramid(), &settings.config, target.size()).map(Some),
    }
}

impl Technique for VirtualTexture {
    type Record = FrameRecord;
    type Error = VirtualTextureError;

    fn needs(&self) -> Vec<Need> {
        needs(&self.settings.config, self.source.format())
    }

    fn passes(&self) -> Vec<&'static str> {
        [vec!["upload"], self.method.passes()].concat()
    }

    fn retire(
        &mut self,
        gpu: &Gpu,
        slot: Slot,
        passes: Vec<PassTime>,
    ) -> Result<FrameRecord, VirtualTextureError> {
        let start = Instant::now();
        let (triples, overflowed) = self.method.collect(gpu, slot)?;
        let seen = self.distinct(&triples);
        let visible = match &mut self.samples_seen {
            Some(samples_seen) => samples_seen.add(&seen),
            None => seen,
        };
        let ahead = match &mut self.scout {
            Some(scout) => scout.collect(gpu, slot)?,
            None => Vec::new(),
        };
        let ahead = self.distinct(&ahead);
        let Streamed { frame, report, list_of } = std::mem::take(&mut self.streamed[slot]);
        self.lists[slot] = Some(Lists { visible: visible.clone(), ahead: ahead.clone() });
        Ok(FrameRecord {
            index: frame,
            streaming: report,
            list_of,
            passes,
            host_list: start.elapsed(),
            triples: triples.len(),
            visible,
            ahead,
            overflowed,
        })
    }

    fn prepare(&mut self, gpu: &Gpu, view: &View) -> Result<(), VirtualTextureError> {
        self.stream(gpu, view)?;
        self.ahead = match (&self.scout, self.pose) {
            (Some(_), Some((last, _))) => {
                continued(&last, &view.pose, self.settings.streaming.prefetch_frames)
            }
            _ => None,
        };
        if self.pose.is_none_or(|(last, _)| last != view.pose) {
            self.pose = Some((view.pose, view.frame));
        }
        self.last_frame = view.frame;
        Ok(())
    }

    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &View,
        target: &Target,
    ) -> Result<(), VirtualTextureError> {
        self.record_frame(frame, view, target)?;
        if let Some(scout) = &mut self.scout {
            scout.record(frame, view.slot(), &self.shapes, self.ahead.as_ref())?;
        }
        Ok(())
    }

    fn resize(&mut self, gpu: &Gpu, target: &Target) -> Result<(), VirtualTextureError> {
        self.settings.size = target.size();
        self.scout = scout(gpu, &*self.source, &self.settings, target)?;
        self.reconfigure(gpu, self.settings.config, target)
    }

    fn progress(&self) -> Progress {
        let Some((_, since)) = self.pose else { return Progress::Arriving };
        // The list that the last frame streamed came from the frame FRAMES_IN_FLIGHT before it.
        let listed = self.last_frame + 1 > since + FRAMES_IN_FLIGHT as u64 + self.frames_to_list() - 1;
        let report = &self.streamed[Slot::of(self.last_frame)].report;
        if listed && self.streaming.settled() && self.fade.settled() {
            Progress::Settled
        } else if !listed || report.loads + report.uploads + report.failures.len() > 0 {
            Progress::Arriving
        } else {
            Progress::Waiting { pending: report.pending }
        }
    }

    fn memory(&self) -> Memory {
        let [j1, g1, h1] = self.resident.bytes();
        let mut memory = self.method.memory();
        memory.extend([
            ("staging on the host", self.uploads.iter().map(Uploads::bytes).sum()),
            ("J1", j1),
            ("G1", g1),
            ("H1", h1),
        ]);
        // Objects are counted by whichever technique brings them.
        let in_the_world = |shape: &&Shape| matches!(shape.draws[..], [Draw::World { .. }]);
        let mesh: u64 = self.shapes.iter().filter(in_the_world).map(Shape::bytes).sum();
        memory.extend((mesh > 0).then_some((MESH, mesh)));
        memory.extend(self.scout.as_ref().map(|scout| ("scout", scout.bytes())));
        memory.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect()
    }
}
