//! Paper 1's part of a frame. This module streams the list of the frame before last, draws the shapes with the
//! resident tiles, and lists their visible tiles. The other files of this folder have the steps.
//!
//! The list of frame n is used in frame n + [`FRAMES_IN_FLIGHT`], so the host never waits for a frame that it has just
//! submitted.

use super::feedback::{self, SampleHistory as SamplesSeen};
use super::prefetch::Prefetch;
use super::record::FrameTiles;
use super::streaming::{Streaming, StreamingCounts, StreamingError, Uploader, distinct_tiles};
use super::tile_pool::{TilePool, TilePoolError, Uploads};
use super::{
    Config, Listing, TextureFrameRecord, Unfit, VirtualTextureSettings, fade::FadeIn,
    footprint::FootprintPass,
};
use super::{method::ListAndDraw, needs};
use crate::frame::{
    Allocations, Draw, DrawList, FrameSlot, Onto, PerFrame, Progress, Records, Run, Shape, Stalled, Target,
    Technique, View,
};
use crate::math::camera::Pose;
use crate::math::light::LightColours;
use crate::math::pyramid::TileId;
use crate::model::mesh::Mesh;
use crate::scene::camera::extrapolated;
use crate::texture::source::TileSource;
use crate::vk::{self, FRAMES_IN_FLIGHT, Frame, Gpu, Need, PassTime};
use glam::DVec3;
use std::sync::Arc;
use std::time::Instant;
use thiserror::Error;

/// Errors that prevent a picture.
#[derive(Debug, Error)]
pub enum VirtualTextureError {
    #[error(transparent)]
    Vulkan(#[from] vk::Error),
    #[error(transparent)]
    TilePool(#[from] TilePoolError),
    #[error(transparent)]
    Variants(#[from] Unfit),
    #[error(transparent)]
    Streaming(#[from] StreamingError),
    #[error("filter.{key}: {what}")]
    Border { key: &'static str, what: String },
    #[error(transparent)]
    Stalled(#[from] Stalled),
}

/// Paper 1's technique: one texture, on any number of shapes.
pub struct VirtualTexture {
    pub source: Arc<dyn TileSource>,
    pub settings: VirtualTextureSettings,
    pub streaming: Streaming,
    pub resident: TilePool,
    pub method: ListAndDraw,
    /// The shapes that carry the texture. Shapes of objects may change before each frame.
    pub shapes: Vec<Shape>,
    /// Direction towards the sun, for lit shapes.
    pub sun: DVec3,
    pub onto: Onto,
    /// True to keep streaming the tiles that were visible when this flag was set, wherever the camera moves.
    pub frozen: bool,
    /// The list that is streamed while frozen: the first one available after `frozen` was set.
    frozen_list: Option<FrameTiles>,
    prefetch: Option<Prefetch>,
    fade: FadeIn,
    uploads: PerFrame<Uploads>,
    /// Lists of frames that have ended, for the frames that will stream them.
    lists: PerFrame<Option<FrameTiles>>,
    streamed: PerFrame<Streamed>,
    /// `Some` if the list is subsampled.
    samples_seen: Option<SamplesSeen>,
    /// The light, if some shapes are lit.
    lit: Option<LightColours>,
    /// The last frame's pose, and the number of the first frame with this pose.
    pose: Option<(Pose, u64)>,
    /// The pose that is predicted from the motion of the camera; `None` without prefetch, or if the pose cannot be
    /// predicted.
    expected: Option<Pose>,
    last_frame: u64,
    bias: u32,
}

/// Name under which [`Technique::memory`] reports the world-space shapes.
pub const MESH: &str = "mesh";

/// The streaming report of a frame in flight.
#[derive(Default)]
struct Streamed {
    frame: u64,
    report: StreamingCounts,
    list_of: Option<u64>,
}

/// Collects a frame's copies into video memory for [`Streaming`].
struct Copies<'a>(&'a mut Uploads);

impl Uploader for Copies<'_> {
    fn upload(&mut self, slot: u32, _: TileId, bytes: &[u8]) -> bool {
        self.0.tile(slot, bytes)
    }
}

impl VirtualTexture {
    /// `lit` is the light, if any of these shapes or later ones are lit.
    ///
    /// # Errors
    /// A missing device feature; settings with which nothing could be shown; a texture whose coarsest levels cannot be
    /// read.
    pub fn new(
        gpu: &Gpu,
        source: Arc<dyn TileSource>,
        shapes: Vec<Shape>,
        settings: VirtualTextureSettings,
        (target, lit): (&Target, Option<LightColours>),
    ) -> Result<VirtualTexture, VirtualTextureError> {
        let pyramid = source.pyramid();
        check(&settings.config, &*source)?;
        let streaming = Streaming::new(source.clone(), settings.streaming.clone())?;
        let resident = TilePool::new(gpu, &*source, settings.streaming.gpu_tiles)?;
        let max_uploads = settings.streaming.upload_tiles_per_frame;
        Ok(VirtualTexture {
            method: ListAndDraw::new(gpu, &pyramid, &settings.config, &resident, target, lit)?,
            prefetch: prefetch(gpu, &*source, &settings, target)?,
            fade: FadeIn::new(settings.config.fade_in_frames),
            uploads: PerFrame::new(|| resident.uploads(gpu, max_uploads))?,
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
            expected: None,
            last_frame: 0,
            source,
            settings,
            streaming,
            resident,
            shapes,
        })
    }

    /// A session with a single world-space mesh, which keeps all records.
    ///
    /// # Errors
    /// As [`VirtualTexture::new`].
    pub fn run(
        gpu: Gpu,
        source: Arc<dyn TileSource>,
        mesh: &Mesh,
        settings: VirtualTextureSettings,
    ) -> Result<Run<VirtualTexture>, VirtualTextureError> {
        check(&settings.config, &*source)?;
        let shape = match settings.config.draws_depth_alone() {
            true => Shape::with_depth_alone(&gpu, mesh)?,
            false => Shape::new(&gpu, mesh)?,
        };
        let target = Target::new(&gpu, settings.size, settings.target)?;
        let technique = VirtualTexture::new(&gpu, source, vec![shape], settings, (&target, None))?;
        let mut run = Run::new(gpu, technique, target);
        run.keep(Records::all());
        Ok(run)
    }

    /// Switches to other settings from the next frame on. No frame may be in flight. Tiles stay in the host cache. They
    /// also stay in the tile pool, unless `gpu_tiles` changes: then they are uploaded again. `lit`: as in
    /// [`VirtualTexture::new`].
    ///
    /// # Errors
    /// A missing device feature; settings that do not fit the texture. The old settings then stay.
    ///
    /// # Panics
    /// As [`Streaming::reconfigure`].
    pub fn reconfigure(
        &mut self,
        gpu: &Gpu,
        settings: VirtualTextureSettings,
        (target, lit): (&Target, Option<LightColours>),
    ) -> Result<(), VirtualTextureError> {
        check(&settings.config, &*self.source)?;
        gpu.require(&needs(&settings.config, self.source.format()))?;
        let (now, next) = (&self.settings.streaming, &settings.streaming);
        let other_pool = now.gpu_tiles != next.gpu_tiles;
        let pool = other_pool.then(|| TilePool::new(gpu, &*self.source, next.gpu_tiles)).transpose()?;
        let resident = pool.as_ref().unwrap_or(&self.resident);
        let method = ListAndDraw::new(gpu, &self.source.pyramid(), &settings.config, resident, target, lit)?;
        let prefetch = prefetch(gpu, &*self.source, &settings, target)?;
        let max = next.upload_tiles_per_frame;
        let other_uploads = now.upload_tiles_per_frame != max;
        let uploads = other_uploads.then(|| PerFrame::new(|| resident.uploads(gpu, max))).transpose()?;
        self.streaming.reconfigure(next.clone())?;
        // From here on nothing fails.
        self.fade.set_frames(settings.config.fade_in_frames);
        if let Some(pool) = pool {
            self.resident = pool;
            self.fade = FadeIn::new(settings.config.fade_in_frames);
        }
        if let Some(uploads) = uploads {
            self.uploads = uploads;
        }
        let samples = |config: &Config| (config.list, config.feedback_log2);
        if samples(&settings.config) != samples(&self.settings.config) {
            self.samples_seen = samples_seen(&settings.config);
        }
        (self.method, self.prefetch, self.lit) = (method, prefetch, lit);
        self.settings = settings;
        self.pose = None;
        Ok(())
    }

    /// Stage 1, which draws the request image; `None` for fused variants.
    pub fn stage1(&self) -> Option<&FootprintPass> {
        self.method.stage1()
    }

    /// The shapes seen from `view`, with tiles chosen as in the last frame.
    pub fn seen(&self, view: View) -> DrawList<'_> {
        DrawList::lit(&self.shapes, view, self.bias, self.sun).onto(self.onto)
    }

    /// The last frame's level bias, the user's constant included.
    pub fn bias(&self) -> u32 {
        self.bias
    }

    /// The last frame's view, for a picture of `size` pixels.
    pub(super) fn last_view(&self, size: [u32; 2]) -> View {
        let (pose, _) = self.pose.expect("asked for after a frame");
        View { frame: self.last_frame, ..View::new(&pose, size) }
    }

    /// Number of frames until the list of a camera at rest is complete.
    pub fn frames_to_list(&self) -> u64 {
        self.samples_seen.as_ref().map_or(1, SamplesSeen::frames)
    }

    /// Forgets the copies of the frame in `slot`, which has ended.
    pub(super) fn without_copies(&mut self, gpu: &Gpu, slot: FrameSlot) -> vk::Result<()> {
        let uploads = &mut self.uploads[slot];
        uploads.clear();
        uploads.show(gpu, &mut self.resident.page_table, &[])
    }

    /// The passes of a frame, except the prefetch.
    pub(super) fn record_frame(&self, frame: &mut Frame<'_>, view: &View, target: &Target) -> vk::Result<()> {
        frame.pass("upload", |cmd| self.resident.copy(cmd, &self.uploads[view.slot()]))?;
        self.method.record(frame, &self.resident, &self.seen(*view), target)
    }

    /// The distinct tiles of a list.
    fn distinct(&self, triples: &[[u32; 3]]) -> Vec<TileId> {
        distinct_tiles(triples, self.settings.config.address, self.source.pyramid().first_resident_level())
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
            // There is no list yet, so the bias stays.
            None => StreamingCounts { bias: self.bias, ..StreamingCounts::default() },
            Some(FrameTiles { visible, expected, .. }) => {
                self.streaming.frame_ahead(visible, expected, &mut Copies(uploads))
            }
        };
        let display = std::mem::take(&mut report.display);
        uploads.show(gpu, &mut self.resident.page_table, &self.fade.cells(&display))?;
        if report.bias != self.bias {
            let bias = report.bias;
            let why = if report.oversubscribed {
                "the visible tiles exceed cache.gpu_tiles"
            } else if bias == self.source.pyramid().first_resident_level() {
                "the coarser levels are always resident"
            } else {
                "the visible tiles fit cache.gpu_tiles"
            };
            tracing::info!("frame {}: level bias {} -> {bias}: {why}", view.frame, self.bias);
            self.bias = bias;
        }
        let list_of = lists.map(|lists| lists.frame);
        self.streamed[slot] = Streamed { frame: view.frame, report, list_of };
        Ok(())
    }
}

/// Checks that the settings fit the texture.
fn check(config: &Config, source: &dyn TileSource) -> Result<(), VirtualTextureError> {
    config.check(&source.pyramid())?;
    match config.filter.tile_fault(source.pyramid().border_texels(), source.pyramid().tile_size()) {
        Some((key, what)) => Err(VirtualTextureError::Border { key, what }),
        None => Ok(()),
    }
}

fn samples_seen(config: &Config) -> Option<SamplesSeen> {
    let subsampled = config.list == Listing::Feedback;
    subsampled.then(|| SamplesSeen::new(feedback::cycle(config.feedback_log2)))
}

fn prefetch(
    gpu: &Gpu,
    source: &dyn TileSource,
    settings: &VirtualTextureSettings,
    target: &Target,
) -> vk::Result<Option<Prefetch>> {
    match settings.streaming.prefetch_frames {
        0 => Ok(None),
        _ => Prefetch::new(gpu, &source.pyramid(), &settings.config, target.size()).map(Some),
    }
}

impl Technique for VirtualTexture {
    type Record = TextureFrameRecord;
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
        slot: FrameSlot,
        passes: Vec<PassTime>,
    ) -> Result<TextureFrameRecord, VirtualTextureError> {
        let start = Instant::now();
        let (triples, overflowed) = self.method.collect(gpu, slot)?;
        let seen = self.distinct(&triples);
        let visible = match &mut self.samples_seen {
            Some(samples_seen) => samples_seen.add(&seen),
            None => seen,
        };
        let expected = match &mut self.prefetch {
            Some(prefetch) => prefetch.collect(gpu, slot)?,
            None => Vec::new(),
        };
        let expected = self.distinct(&expected);
        let Streamed { frame, report, list_of } = std::mem::take(&mut self.streamed[slot]);
        self.lists[slot] = Some(FrameTiles { frame, visible: visible.clone(), expected: expected.clone() });
        Ok(TextureFrameRecord {
            index: frame,
            streaming: report,
            list_of,
            passes,
            host_list: start.elapsed(),
            triples: triples.len(),
            visible,
            expected,
            overflowed,
        })
    }

    fn prepare(&mut self, gpu: &Gpu, view: &View) -> Result<(), VirtualTextureError> {
        self.stream(gpu, view)?;
        self.expected = match (&self.prefetch, self.pose) {
            (Some(_), Some((last, _))) => {
                extrapolated(&last, &view.pose, self.settings.streaming.prefetch_frames)
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
        if let Some(prefetch) = &mut self.prefetch {
            prefetch.record(frame, view.slot(), &self.shapes, self.expected.as_ref())?;
        }
        Ok(())
    }

    fn resize(&mut self, gpu: &Gpu, target: &Target) -> Result<(), VirtualTextureError> {
        let settings = VirtualTextureSettings { size: target.size(), ..self.settings.clone() };
        self.reconfigure(gpu, settings, (target, self.lit))
    }

    fn lift_budgets(&mut self, lifted: bool) {
        self.streaming.lift_budgets(lifted);
    }

    fn progress(&self) -> Progress {
        let Some((_, since)) = self.pose else { return Progress::Arriving };
        // The last frame streamed the list of the frame FRAMES_IN_FLIGHT frames earlier.
        let listed = self.last_frame + 1 > since + FRAMES_IN_FLIGHT as u64 + self.frames_to_list() - 1;
        let report = &self.streamed[FrameSlot::of(self.last_frame)].report;
        if listed && self.streaming.settled() && self.fade.settled() {
            Progress::Settled
        } else if !listed || report.bias_held || report.loads + report.uploads + report.failures.len() > 0 {
            Progress::Arriving
        } else {
            Progress::Waiting { pending: report.pending }
        }
    }

    fn memory(&self) -> Allocations {
        let [j1, g1, h1] = self.resident.bytes();
        let mut memory = self.method.memory();
        memory.extend([
            ("staging on the host", self.uploads.iter().map(Uploads::bytes).sum()),
            ("tile pool", j1),
            ("resident levels", g1),
            ("page table", h1),
        ]);
        // The technique that adds an object counts its memory.
        let in_the_world = |shape: &&Shape| matches!(shape.draws[..], [Draw::World { .. }]);
        let mesh: u64 = self.shapes.iter().filter(in_the_world).map(Shape::bytes).sum();
        memory.extend((mesh > 0).then_some((MESH, mesh)));
        memory.extend(self.prefetch.as_ref().map(|prefetch| ("prefetch", prefetch.bytes())));
        memory.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect()
    }
}
