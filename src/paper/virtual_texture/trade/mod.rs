//! The trade between time and accuracy in one scene. For every combination of some [`Knob`]s' values, the settled frame
//! is timed and its picture compared with the `truth`.

mod budgets;
mod knobs;
mod settings;
mod times;
mod truth;
mod values;

pub use knobs::Knob;
pub use settings::{not_turned, settings};
pub use times::{Batch, MAX_REPEATS, in_milliseconds};
pub use truth::{Mosaic, TradeKernel};
pub use values::SweepPoint;

use crate::figure::{Bench, Contender, Errors, Machine, Refused, Trade};
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::model::mesh::{self, Mesh};
use crate::paper::virtual_texture::config::{open_texture, source_mesh, texture};
use crate::paper::virtual_texture::{
    VirtualTexture, VirtualTextureError, VirtualTextureSettings, all_needs, lacks,
};
use crate::picture::PixelFormat;
use crate::picture::measures::{Comparison, Measures, OUTLIER_BOUND};
use crate::scene::{Scene, choices};
use crate::texture::source::cached::CachedSource;
use crate::texture::source::{TileFormat, TileSource};
use crate::vk::{Gpu, PassTime};
use anyhow::Context;
use std::collections::HashMap;
use std::sync::Arc;

/// Number of settings that are timed in turn, together with the scene's own setting. Each has its own tile pool: 260 MB
/// for 192 tiles.
const TOGETHER: usize = 4;

choices! {
    /// The error measure of the Pareto front.
    pub enum ErrorMeasure {
        /// Normalised mean squared error.
        Nmse = "nmse",
        /// Mean FLIP: the difference that a viewer would see.
        Flip = "flip",
        /// Largest error of a channel, in linear light.
        Max = "max",
    }
}

impl ErrorMeasure {
    /// The name in reports.
    pub fn label(self) -> &'static str {
        match self {
            ErrorMeasure::Nmse => "NMSE",
            ErrorMeasure::Flip => "FLIP",
            ErrorMeasure::Max => "largest error",
        }
    }

    fn of(self, errors: &Errors) -> f64 {
        match self {
            ErrorMeasure::Nmse => errors.nmse,
            ErrorMeasure::Flip => errors.flip,
            ErrorMeasure::Max => errors.max,
        }
    }
}

/// The parameters of a sweep.
pub struct TradeSweep<'a> {
    pub scene: &'a Scene,
    pub pose: Pose,
    /// In pixels.
    pub size: [u32; 2],
    pub knobs: &'a [Knob],
    pub measure: ErrorMeasure,
    pub kernel: TradeKernel,
}

/// The resources that all settings share.
struct SweepResources<'a> {
    sweep: &'a TradeSweep<'a>,
    gpu: Gpu,
    mesh: Mesh,
    truth: Mosaic,
    /// Sources by border and format. They are shared because an Earth tile takes 13 ms of a core and most settings need
    /// the same tiles.
    sources: HashMap<(u32, TileFormat), Arc<CachedSource>>,
}

impl TradeSweep<'_> {
    /// Measures all settings. `progress` receives the number of settings done and the number of all settings.
    ///
    /// # Errors
    /// An unavailable scene or device; a file of BC1 tiles, which lacks the exact texels; a device without timestamps.
    pub fn run(&self, bench: &Bench, progress: impl Fn(usize, usize)) -> anyhow::Result<Trade> {
        let settings = settings(self.scene, self.knobs)?;
        let mut stage = self.stage(bench)?;
        let (own, others) = settings.split_first().expect("the scene's own setting");
        let mut anchor = stage.open(own)?.map_err(anyhow::Error::msg)?;
        let (mut batches, mut refused) = (Vec::new(), not_turned(self.scene, self.knobs)?);
        for (n, batch) in others.chunks(TOGETHER).enumerate() {
            let mut opened = Vec::new();
            for setting in batch {
                match stage.open(setting)? {
                    Ok(session) => opened.push(session),
                    Err(why) => refused.push(Refused { name: setting.name.clone(), why }),
                }
            }
            batches.push(stage.time(bench, &mut anchor, opened)?);
            progress((1 + (n + 1) * TOGETHER).min(settings.len()), settings.len());
        }
        if batches.is_empty() {
            batches.push(stage.time(bench, &mut anchor, Vec::new())?);
        }
        let budgets = match self.knobs.contains(&Knob::Budgets) {
            true => budgets::measure(bench, &stage, &anchor.session.picture_bytes()?)?,
            false => Vec::new(),
        };
        let (settings, drift_ms) = in_milliseconds(&anchor.found, batches, self.measure);
        let mut trade = Trade {
            scene: self.scene.name.clone(),
            size: self.size,
            measure: self.measure.label().to_string(),
            truth: stage.truth.describe(),
            machine: Machine::here(stage.gpu.physical()),
            runs: bench.runs(),
            max_runs: MAX_REPEATS * bench.runs(),
            drift_ms,
            settings,
            refused,
            budgets,
        };
        trade.mark_front();
        Ok(trade)
    }

    fn stage(&self, bench: &Bench) -> anyhow::Result<SweepResources<'_>> {
        let scene = self.scene;
        // The truth uses the texels before BC1 encoding.
        let own = texture(scene)?;
        let exact = match own.format {
            TileFormat::Rgba8 => scene.clone(),
            TileFormat::Bc1 => {
                scene.with(&[format!("{}.texture.format=rgba8", settings::surface(scene)?)])?
            }
        };
        let source = open_texture(&exact).with_context(|| format!("scene {}", scene.name))?;
        anyhow::ensure!(
            source.format() == TileFormat::Rgba8,
            "the reference needs exact texels, but bc1 is lossy ({}); bake the texture with --format rgba8",
            source.describe()
        );
        let mesh = source_mesh(scene)?;
        let source = CachedSource::new(source);
        Ok(SweepResources {
            sweep: self,
            gpu: bench.gpu_with_offered(&all_needs())?,
            mesh: mesh::gpu_mesh(&mesh),
            truth: Mosaic::new(&*source, &mesh, &self.pose, self.size, self.kernel)?,
            sources: HashMap::from([((own.border, TileFormat::Rgba8), source)]),
        })
    }
}

/// A setting and the errors of its settled picture.
pub struct TradeResult {
    pub setting: SweepPoint,
    pub measures: Measures,
    pub forced_bias: u32,
    /// See [`TimedSetting::list_frames`](crate::figure::TimedSetting::list_frames).
    pub list_frames: u64,
}

/// A setting with its settled session.
struct Open {
    found: TradeResult,
    session: Run<VirtualTexture>,
}

impl SweepResources<'_> {
    /// A settled session; the inner error is the reason why the setting does not run here.
    fn open(&mut self, setting: &SweepPoint) -> anyhow::Result<Result<Open, String>> {
        let TradeSweep { pose, size, .. } = self.sweep;
        let scene = match self.sweep.scene.with(&setting.changes) {
            Ok(scene) => scene,
            Err(error) => return Ok(Err(error.to_string())),
        };
        let texture = texture(&scene)?;
        let key = (texture.border, texture.format);
        let source = match self.sources.get(&key) {
            Some(source) => source.clone(),
            None => CachedSource::new(open_texture(&scene)?),
        };
        self.sources.insert(key, source.clone());
        let mut settings = VirtualTextureSettings::of_scene(&scene, PixelFormat::Srgb8)?;
        settings.size = *size;
        // Settling is not timed: upload as many tiles per frame as staging memory allows.
        settings.streaming.deterministic = true;
        settings.streaming.upload_tiles_per_frame = 32;
        settings.streaming.load_tiles_per_frame = 32;
        if let Some(why) = lacks(&self.gpu, &settings.config, &source.pyramid(), source.format()) {
            return Ok(Err(why));
        }
        let mut session = match VirtualTexture::run(self.gpu.clone(), source, &self.mesh, settings) {
            Ok(session) => session,
            Err(error @ (VirtualTextureError::Border { .. } | VirtualTextureError::Variants(_))) => {
                return Ok(Err(error.to_string()));
            }
            Err(error) => return Err(error.into()),
        };
        session.settle(pose)?;
        session.drain()?;
        // One more frame, with a fixed number: the noise depends only on the frame's number, so every run is the same.
        session.again(pose)?;
        let picture = self.truth.cut(&session.picture_bytes()?);
        let measures = Comparison::of(&picture, &self.truth.picture)?.measures(OUTLIER_BOUND);
        // A set bias beyond the coarsest level is clamped, so the actual bias can be less than the set one.
        let forced_bias =
            session.technique.bias().saturating_sub(session.technique.settings.config.level_bias);
        let list_frames = session.technique.frames_to_list();
        let found = TradeResult { setting: setting.clone(), measures, forced_bias, list_frames };
        Ok(Ok(Open { found, session }))
    }

    fn time(&self, bench: &Bench, own: &mut Open, opened: Vec<Open>) -> anyhow::Result<Batch> {
        let (found, mut sessions): (Vec<TradeResult>, Vec<_>) =
            opened.into_iter().map(|open| (open.found, open.session)).unzip();
        let names = std::iter::once(&own.found).chain(&found).map(|found| found.setting.name.clone());
        let sessions = std::iter::once(&mut own.session).chain(&mut sessions);
        let contenders = names.zip(sessions).map(|(variant, session)| Contender {
            variant,
            run: Box::new(move || {
                let finished = session.again(&self.sweep.pose)?;
                let ns = Some(finished.host_time.as_nanos() as u64);
                let mut times = finished.times;
                times.push(PassTime { label: "list on the host".into(), ns, work: None });
                Ok(times)
            }),
        });
        let contenders = contenders.collect();
        Batch::time(bench, &self.gpu, self.sweep.measure, &found, contenders)
    }
}
