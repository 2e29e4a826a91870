//! `--report`: everything that a run measured, as JSON, with what it takes to repeat the run.

mod surfaces;

pub use surfaces::SurfacesReport;

use crate::paper::virtual_texture::session::{FrameRecord, PlainComparison, Session};
use crate::stats::Summary;
use crate::vk::{FRAMES_IN_FLIGHT, PassTime};
use serde::Serialize;
use std::collections::BTreeMap;

/// The whole file. Sizes in texels, times in nanoseconds, memory in bytes; levels as in the paper.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub device: String,
    pub device_kind: &'static str,
    pub driver: String,
    pub vulkan: String,
    pub scene: String,
    pub camera: String,
    pub texture: String,
    pub texture_width: u32,
    pub texture_height: u32,
    pub tile_size: u32,
    pub border: u32,
    /// L: the coarsest level's index.
    pub levels: u32,
    /// L'
    pub resident_levels: u32,
    /// NA
    pub max_anisotropy: u32,
    pub picture_width: u32,
    pub picture_height: u32,
    pub variant: VariantReport,
    pub cache: CacheReport,
    /// A frame's list is used so many frames later.
    pub latency_frames: usize,
    /// Whether the last frame shows every tile that its pose needs (unreadable ones apart).
    pub settled: bool,
    /// Tiles that could not be read in the whole run; each was reported once.
    pub unreadable_tiles: usize,
    /// Frames in which `U3` was too short and stage 3 ran twice.
    pub list_overflows: usize,
    pub memory_bytes: BTreeMap<&'static str, u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plain: Option<PlainReport>,
    pub frames: Vec<FrameReport>,
    pub manifest: Manifest,
}

/// Which variant ran.
#[derive(Clone, Debug, Serialize)]
pub struct VariantReport {
    /// As used, also where the scene leaves the choice to the device.
    pub u1: &'static str,
    pub list: &'static str,
    pub feedback_log2: u32,
    pub dedup: &'static str,
    pub block_log2: u32,
    pub memo: bool,
    pub keying: &'static str,
    pub compact: &'static str,
    pub compact_block_log2: u32,
    pub interpolation: &'static str,
}

#[derive(Clone, Debug, Serialize)]
pub struct CacheReport {
    /// N1
    pub gpu_tiles: u32,
    /// N2
    pub host_tiles: u32,
    pub upload_budget_ms: f64,
    pub load_budget_ms: f64,
    pub upload_tiles_per_frame: u32,
    pub load_tiles_per_frame: u32,
    /// Budgets counted tiles instead of time.
    pub deterministic: bool,
}

/// `--compare-plain`: medians over interleaved runs in this process.
#[derive(Clone, Debug, Serialize)]
pub struct PlainReport {
    /// The settled frame over the plain one that was drawn in turn with it.
    pub settled_over_plain: Summary,
    pub settled_frame_ns: Summary,
    pub settled_passes_ns: Vec<(String, f64)>,
    pub plain_frame_ns: Summary,
    pub plain_texture: [u32; 2],
    pub empty_pass_ns: Summary,
}

/// One frame.
#[derive(Clone, Debug, Serialize)]
pub struct FrameReport {
    pub frame: u64,
    pub passes: Vec<PassReport>,
    /// The host's time from the frame's end to its list of tiles.
    pub host_list_ns: u64,
    /// The frame's own list, and its distinct tiles (subsampled: those that the cycle's frames saw together).
    pub triples: usize,
    pub tiles: usize,
    /// What streaming did in this frame, for the list of that frame (`latency_frames` ago; none at the start).
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
    /// Levels by which tiles were taken coarser, because N1 was too small (or the user asked so).
    pub bias: u32,
    pub oversubscribed: bool,
}

#[derive(Clone, Debug, Serialize)]
pub struct PassReport {
    pub label: String,
    pub ns: Option<u64>,
}

/// What it takes to repeat the run.
#[derive(Clone, Debug, Serialize)]
pub struct Manifest {
    pub version: &'static str,
    pub commit: &'static str,
    pub arguments: Vec<String>,
    /// Variables that change what the loader, the driver or we do.
    pub environment: BTreeMap<String, String>,
}

impl Manifest {
    /// Of this process.
    pub fn of_this_process() -> Manifest {
        // JSON has no other text than Unicode; what is none is told with replacement characters.
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

impl From<PlainComparison> for PlainReport {
    fn from(comparison: PlainComparison) -> Self {
        PlainReport {
            settled_over_plain: comparison.ratio,
            settled_frame_ns: comparison.settled,
            settled_passes_ns: comparison.settled_passes,
            plain_frame_ns: comparison.plain,
            plain_texture: comparison.plain_size,
            empty_pass_ns: comparison.empty_pass,
        }
    }
}

impl From<&FrameRecord> for FrameReport {
    fn from(record: &FrameRecord) -> Self {
        let FrameRecord { streaming, passes, .. } = record;
        FrameReport {
            frame: record.index,
            passes: passes
                .iter()
                .map(|PassTime { label, ns }| PassReport { label: label.clone(), ns: *ns })
                .collect(),
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

impl Session {
    /// The report of all frames so far. `scene` and `camera` are the names that the user gave.
    pub fn report(&self, scene: &str, camera: &str, plain: Option<PlainComparison>) -> Report {
        let physical = self.gpu.physical();
        let pyramid = self.source.pyramid();
        let (config, streaming) = (&self.settings.config, &self.settings.streaming);
        let [texture_width, texture_height] = pyramid.level_size(0);
        let (major, minor, patch) = physical.api;
        let frames: Vec<FrameReport> = self.records.iter().map(FrameReport::from).collect();
        Report {
            device: physical.name.clone(),
            device_kind: physical.kind,
            driver: physical.driver.clone(),
            vulkan: format!("{major}.{minor}.{patch}"),
            scene: scene.to_string(),
            camera: camera.to_string(),
            texture: self.source.describe(),
            texture_width,
            texture_height,
            tile_size: pyramid.tile_size(),
            border: pyramid.border_texels(),
            levels: pyramid.coarsest_level(),
            resident_levels: pyramid.resident_levels(),
            max_anisotropy: config.filter.max_anisotropy,
            picture_width: self.settings.size[0],
            picture_height: self.settings.size[1],
            variant: VariantReport {
                u1: self.pipeline.stage1().map_or("none", |stage1| stage1.format.name()),
                list: config.list.name(),
                feedback_log2: config.feedback_log2,
                dedup: config.dedup.name(),
                block_log2: config.block_log2,
                memo: config.memo,
                keying: config.keying.name(),
                compact: config.compact.name(),
                compact_block_log2: config.compact_block_log2,
                interpolation: config.filter.interpolation.name(),
            },
            cache: CacheReport {
                gpu_tiles: streaming.gpu_tiles,
                host_tiles: streaming.host_tiles,
                upload_budget_ms: streaming.upload_budget_ms,
                load_budget_ms: streaming.load_budget_ms,
                upload_tiles_per_frame: streaming.upload_tiles_per_frame,
                load_tiles_per_frame: streaming.load_tiles_per_frame,
                deterministic: streaming.deterministic,
            },
            latency_frames: FRAMES_IN_FLIGHT,
            settled: self.settled(),
            unreadable_tiles: frames.iter().map(|frame| frame.failures.len()).sum(),
            list_overflows: self.records.iter().filter(|record| record.overflowed).count(),
            memory_bytes: self.memory().into_iter().collect(),
            plain: plain.map(PlainReport::from),
            frames,
            manifest: Manifest::of_this_process(),
        }
    }
}
