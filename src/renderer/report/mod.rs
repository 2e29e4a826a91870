//! `--report`: all measurements of a run as JSON, with the data needed to repeat the run.

mod run;
mod surfaces;

pub use run::{FORMAT, ReportError, RunSection};
pub use surfaces::{InstanceBytes, SurfaceReport, SurfacesFrame};

use super::{Record, Renderer};
use crate::paper::virtual_texture::streaming::StreamingConfig;
use crate::paper::virtual_texture::{Config, PlainComparison, TextureFrameRecord, VirtualTexture};
use crate::picture::write::{FileError, write_atomically};
use crate::vk::{FRAMES_IN_FLIGHT, PassTime};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

/// The whole file. Times in nanoseconds, memory in bytes.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub device: String,
    pub device_kind: &'static str,
    pub driver: String,
    pub vulkan: String,
    pub scene: String,
    pub camera: String,
    pub picture_width: u32,
    pub picture_height: u32,
    /// A frame's list is used this many frames later.
    pub latency_frames: usize,
    /// True if the last frame shows everything that its pose needs (except unreadable tiles).
    pub settled: bool,
    #[serde(flatten)]
    pub texture: Option<TextureReport>,
    /// Progressive meshes by the name of their surface.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub surfaces: BTreeMap<String, SurfaceReport>,
    /// Bytes by surface and object; video memory unless the name says otherwise.
    pub memory_bytes: BTreeMap<String, u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plain: Option<PlainComparison>,
    pub frames: Vec<FrameReport>,
    /// The data needed to render the picture again. `None` if another program rendered the frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub run: Option<RunSection>,
    pub manifest: Manifest,
}

/// The virtual texture. Sizes in texels; levels as in the paper.
#[derive(Clone, Debug, Serialize)]
pub struct TextureReport {
    pub texture: String,
    pub texture_width: u32,
    pub texture_height: u32,
    pub tile_size: u32,
    pub border: u32,
    /// L: the coarsest level's index.
    pub levels: u32,
    /// L': the number of coarsest levels that are always in video memory.
    pub resident_levels: u32,
    /// Storage format of a pixel's triple; "none" if the variant stores none.
    pub request_image: &'static str,
    /// Every setting of the paper, as described by `ortelius keys`: the variant with its filter, and the caches.
    pub variant: Config,
    pub cache: StreamingConfig,
    /// Tiles that could not be read in the frames of this report; each was reported once.
    pub unreadable_tiles: usize,
    /// Frames whose visible-tile list overflowed, so that stage 3 ran twice.
    pub list_overflows: usize,
}

/// One frame.
#[derive(Clone, Debug, Serialize)]
pub struct FrameReport {
    pub frame: u64,
    pub passes: Vec<PassTime>,
    #[serde(flatten)]
    pub texture: Option<TextureFrame>,
    #[serde(flatten)]
    pub surfaces: Option<SurfacesFrame>,
}

/// The virtual texture's part of a frame.
#[derive(Clone, Debug, Serialize)]
pub struct TextureFrame {
    /// Host time from the frame's end to its list of tiles.
    pub host_list_ns: u64,
    /// `triples`: length of the frame's own visible-tile list. `tiles`: number of distinct visible tiles;
    /// with subsampled feedback, in the union of the last 2^n frames.
    pub triples: usize,
    pub tiles: usize,
    /// The number of the frame whose visible-tile list this frame's streaming used (`latency_frames` earlier; null at
    /// the start).
    pub list_of_frame: Option<u64>,
    pub wanted: usize,
    pub hits: usize,
    pub misses: usize,
    pub pending: usize,
    pub loads: usize,
    pub uploads: usize,
    pub upload_bytes: u64,
    pub gpu_evictions: usize,
    pub host_evictions: usize,
    pub stale_loads: usize,
    pub failures: Vec<String>,
    /// Levels by which tiles are coarser, because the tile pool has too few slots (or the user requested it).
    pub bias: u32,
    pub oversubscribed: bool,
}

/// The program, its arguments and its environment.
#[derive(Clone, Debug, Serialize)]
pub struct Manifest {
    pub version: &'static str,
    pub commit: &'static str,
    pub arguments: Vec<String>,
    /// Variables that affect the loader, the driver or this program.
    pub environment: BTreeMap<String, String>,
}

impl Manifest {
    /// Manifest of the current process.
    pub fn of_this_process() -> Manifest {
        // JSON text is Unicode; other bytes become replacement characters.
        let text = |text: std::ffi::OsString| text.to_string_lossy().into_owned();
        let matters = |name: &str| {
            ["VK_", "LP_", "GALLIVM_", "MESA_", "ORTELIUS_", "LIBGL_", "RAYON_"]
                .iter()
                .any(|p| name.starts_with(p))
        };
        Manifest {
            version: env!("CARGO_PKG_VERSION"),
            commit: env!("ORTELIUS_COMMIT"),
            arguments: std::env::args_os().map(text).collect(),
            environment: std::env::vars_os()
                .map(|(name, value)| (text(name), text(value)))
                .filter(|(name, _)| matters(name))
                .collect(),
        }
    }
}

impl From<&Record> for FrameReport {
    fn from(record: &Record) -> Self {
        FrameReport {
            frame: record.frame,
            passes: record.passes.clone(),
            texture: record.texture.as_ref().map(TextureFrame::from),
            surfaces: record.meshes.as_ref().map(SurfacesFrame::from),
        }
    }
}

impl From<&TextureFrameRecord> for TextureFrame {
    fn from(record: &TextureFrameRecord) -> Self {
        let streaming = &record.streaming;
        TextureFrame {
            host_list_ns: record.host_list.as_nanos() as u64,
            triples: record.triples,
            tiles: record.visible.len(),
            list_of_frame: record.list_of,
            wanted: streaming.wanted,
            hits: streaming.hits,
            misses: streaming.misses,
            pending: streaming.pending,
            loads: streaming.loads,
            uploads: streaming.uploads,
            upload_bytes: streaming.upload_bytes,
            gpu_evictions: streaming.gpu_evictions,
            host_evictions: streaming.host_evictions,
            stale_loads: streaming.stale_loads,
            failures: streaming.failures.iter().map(|failure| failure.reason.clone()).collect(),
            bias: streaming.bias,
            oversubscribed: streaming.oversubscribed,
        }
    }
}

impl TextureReport {
    /// Summarises the frames that are kept.
    fn of(technique: &VirtualTexture, records: &[Record]) -> TextureReport {
        let pyramid = technique.source.pyramid();
        let [texture_width, texture_height] = pyramid.level_size(0);
        let frames = || records.iter().filter_map(|record| record.texture.as_ref());
        TextureReport {
            texture: technique.source.describe(),
            texture_width,
            texture_height,
            tile_size: pyramid.tile_size(),
            border: pyramid.border_texels(),
            levels: pyramid.coarsest_level(),
            resident_levels: pyramid.resident_levels(),
            request_image: technique.stage1().map_or("none", |stage1| stage1.format.name()),
            variant: technique.settings.config,
            cache: technique.settings.streaming.clone(),
            unreadable_tiles: frames().map(|frame| frame.streaming.failures.len()).sum(),
            list_overflows: frames().filter(|frame| frame.overflowed).count(),
        }
    }
}

impl Report {
    /// The report of the frames whose records are kept (see [`Records`](crate::frame::Records)). `scene` and `camera`
    /// are the names that the user gave.
    pub fn of(renderer: &Renderer, scene: &str, camera: &str, plain: Option<PlainComparison>) -> Report {
        let physical = renderer.gpu.physical();
        let (major, minor, patch) = physical.api;
        let surfaces = renderer.technique.meshes.iter().flat_map(|meshes| &meshes.surfaces);
        let [picture_width, picture_height] = renderer.size();
        Report {
            device: physical.name.clone(),
            device_kind: physical.kind,
            driver: physical.driver.clone(),
            vulkan: format!("{major}.{minor}.{patch}"),
            scene: scene.to_string(),
            camera: camera.to_string(),
            picture_width,
            picture_height,
            latency_frames: FRAMES_IN_FLIGHT,
            settled: renderer.settled(),
            texture: renderer
                .technique
                .texture
                .as_ref()
                .map(|technique| TextureReport::of(technique, &renderer.records)),
            surfaces: surfaces.map(|surface| (surface.name.clone(), SurfaceReport::from(surface))).collect(),
            memory_bytes: renderer.memory().into_iter().collect(),
            plain,
            frames: renderer.records.iter().map(FrameReport::from).collect(),
            run: None,
            manifest: Manifest::of_this_process(),
        }
    }

    /// Writes the report as JSON, atomically.
    ///
    /// # Errors
    /// [`FileError`] names the path.
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        write_atomically(path, |file| {
            serde_json::to_writer_pretty(&mut *file, &FORMAT.head(self))?;
            writeln!(file)
        })
    }
}
